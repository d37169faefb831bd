// SPDX-License-Identifier: MIT
// Runs `clothstream` against the real clothstream-server.
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::uint32_t kVertices = 17 * 13 + 9 * 11;
constexpr std::uint32_t kTriangles = 2 * (16 * 12 + 8 * 10);

class Join : public RunningServer {
 protected:
  void SetUp() override {
    Arguments arguments = kSmallScene;
    arguments.insert(arguments.end(), {"--scene-file", "tests/e2e/small_with_normals.json"});
    startServer(arguments);
  }

  std::unique_ptr<Process> clothstream(std::vector<std::string> arguments,
                                       Process::Output output = Process::Output::pipe) const {
    arguments.insert(arguments.begin(), CLOTHSTREAM);
    return std::make_unique<Process>(arguments, output);
  }
};

struct Obj {
  std::vector<std::array<double, 3>> positions, normals;
  std::vector<std::string> groups;
  std::size_t faces = 0;
};

Obj readObj(const std::filesystem::path& path) {
  Obj obj;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string keyword, name;
    words >> keyword;
    std::array<double, 3> values{};
    if (keyword == "g") {
      words >> name;
      obj.groups.push_back(name);
    } else if (keyword == "f") {
      for (std::size_t vertex = 0, normal = 0, corner = 0; corner < 3; ++corner) {
        char slash = 0;
        words >> vertex >> slash >> slash >> normal;
        EXPECT_EQ(vertex, normal);
        EXPECT_GE(vertex, 1u);
        EXPECT_LE(vertex, obj.positions.size());
      }
      ++obj.faces;
    } else if (keyword == "v" || keyword == "vn") {
      words >> values[0] >> values[1] >> values[2];
      (keyword == "v" ? obj.positions : obj.normals).push_back(values);
    }
    EXPECT_FALSE(words.fail()) << line;
  }
  return obj;
}

TEST_F(Join, DecodesFramesAndWritesLastAsObj) {
  const TemporaryDirectory directory;
  const std::filesystem::path obj = directory.path() / "last.obj";
  const auto client = clothstream({"join", address_, "--json", "--hash", "--seconds", "2", "--obj", obj});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();

  const auto report = nlohmann::json::parse(client->output());
  EXPECT_EQ(report.at("scene"), "small");
  EXPECT_EQ(report.at("vertices"), kVertices);
  EXPECT_THAT(report.at("device").get<std::string>(), Not(IsEmpty()));
  EXPECT_EQ(report.at("hashMismatches"), 0);
  EXPECT_EQ(report.at("decodeErrors"), 0);
  EXPECT_GE(report.at("frames").get<int>(), 2);
  // A frame is two ticks long.
  EXPECT_GE(report.at("ticks").get<int>(), 2 * (report.at("frames").get<int>() - 1));
  EXPECT_GT(report.at("fps").get<double>(), 0);
  EXPECT_LT(report.at("fps").get<double>(), 61 * 2);
  EXPECT_GT(report.at("kbitPerSecond").get<double>(), 0);
  EXPECT_GT(report.at("bitsPerVertex").get<double>(), 0);
  EXPECT_LT(report.at("bitsPerVertex").get<double>(), 96);
  EXPECT_GT(report.at("roundTripMs").get<double>(), 0);
  EXPECT_GE(report.at("dropped").get<int>(), 0);

  const Obj written = readObj(obj);
  EXPECT_EQ(written.positions.size(), kVertices);
  EXPECT_EQ(written.normals.size(), kVertices);
  EXPECT_EQ(written.faces, kTriangles);
  EXPECT_THAT(written.groups, ::testing::ElementsAre("left", "right"));
  for (const auto& normal : written.normals)
    EXPECT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1, 1e-5);
  // The pinned corner is at its place, with an error of at most 0.5 mm along each axis.
  EXPECT_LT(std::hypot(written.positions[0][0] + 0.8, written.positions[0][1] - 2),
            std::sqrt(3) * 0.0005 + 1e-6);
  // The wind blows towards +Z and has moved the middle of the lower edge that way.
  EXPECT_GT(written.positions[16 * 13 + 6][2], 0.001);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory.path()), {}), 1)
      << "no other file is left";
}

TEST_F(Join, UsesNormalsOfTheStream) {
  const auto client =
      clothstream({"join", address_, "--scene", "small_with_normals", "--json", "--hash", "--seconds", "1"});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  const auto report = nlohmann::json::parse(client->output());
  EXPECT_EQ(report.at("scene"), "small_with_normals");
  EXPECT_EQ(report.at("vertices"), 144);
  EXPECT_EQ(report.at("hashMismatches"), 0);
  EXPECT_GE(report.at("frames").get<int>(), 2);
}

TEST_F(Join, TwoClientsSeeTheSameScene) {
  const std::vector<std::string> arguments{"join", address_, "--json", "--hash", "--seconds", "2"};
  const auto first = clothstream(arguments), second = clothstream(arguments);
  for (const auto& client : {first.get(), second.get()}) {
    ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
    const auto report = nlohmann::json::parse(client->output());
    EXPECT_GE(report.at("frames").get<int>(), 2);
    EXPECT_EQ(report.at("hashMismatches"), 0);
    EXPECT_EQ(report.at("decodeErrors"), 0);
  }
}

TEST_F(Join, ColliderPushesTheCloth) {
  const TemporaryDirectory directory;
  const std::filesystem::path obj = directory.path() / "pushed.obj";
  // Behind the middle of the right sheet.
  const auto client =
      clothstream({"join", address_, "--seconds", "3", "--collider", "0.5,1.8,-0.05,0.15", "--obj", obj});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  const Obj written = readObj(obj);
  ASSERT_EQ(written.positions.size(), kVertices);
  for (const auto& p : written.positions) {
    // Outside the sphere, except for the streamed error of 0.5 mm along each axis.
    EXPECT_GT(std::hypot(p[0] - 0.5, p[1] - 1.8, p[2] + 0.05), 0.15 - 0.001);
  }
}

TEST_F(Join, RefusalOfUnknownSceneListsScenes) {
  const auto client = clothstream({"join", address_, "--scene", "nowhere", "--seconds", "1"});
  EXPECT_EQ(client->waitForEnd(kPatience), 4);
  EXPECT_THAT(client->errors(), HasSubstr("nowhere"));
  EXPECT_THAT(client->errors(), HasSubstr("small_with_normals"));
  EXPECT_THAT(client->output(), IsEmpty());
}

TEST_F(Join, CreatesPausesResetsAndDeletesScenes) {
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", address_});
    const auto client = clothstream(arguments);
    const int code = client->waitForEnd(kPatience).value_or(-1);
    return std::pair(code, client->output() + client->errors());
  };
  const auto stateOf = [&](const std::string& name) {
    const auto list = clothstream({"list", address_, "--json"});
    EXPECT_EQ(list->waitForEnd(kPatience), 0);
    for (const auto& scene : nlohmann::json::parse(list->output()))
      if (scene.at("name") == name) return scene;
    return nlohmann::json();
  };
  EXPECT_EQ(run({"create", "tests/e2e/small.json", "--name", "mine"}), std::pair(0, std::string("mine\n")));
  EXPECT_EQ(stateOf("mine").at("vertices"), kVertices);
  EXPECT_EQ(stateOf("mine").at("created"), true);
  EXPECT_EQ(run({"create", "--named", "tablecloth", "--name", "cloth-2", "--max-participants", "3"}),
            std::pair(0, std::string("cloth-2\n")));
  EXPECT_EQ(stateOf("cloth-2").at("maxParticipants"), 3);
  const auto client =
      clothstream({"join", address_, "--scene", "mine", "--json", "--hash", "--seconds", "1"});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  EXPECT_EQ(nlohmann::json::parse(client->output()).at("hashMismatches"), 0);

  EXPECT_EQ(run({"pause", "mine"}).first, 0);
  EXPECT_EQ(stateOf("mine").at("paused"), true);
  // A client that joins the paused scene sees the cloth as the wind has moved it.
  const TemporaryDirectory shown;
  const std::filesystem::path obj = shown.path() / "paused.obj";
  const auto late = clothstream(
      {"join", address_, "--scene", "mine", "--json", "--hash", "--seconds", "1", "--obj", obj.string()});
  ASSERT_EQ(late->waitForEnd(kPatience), 0) << late->errors();
  EXPECT_EQ(nlohmann::json::parse(late->output()).at("frames"), 1);
  EXPECT_EQ(nlohmann::json::parse(late->output()).at("hashMismatches"), 0);
  const Obj written = readObj(obj);
  ASSERT_EQ(written.positions.size(), kVertices);
  EXPECT_GT(written.positions[16 * 13 + 6][2], 0.001);
  EXPECT_EQ(run({"resume", "mine"}).first, 0);
  EXPECT_EQ(stateOf("mine").at("paused"), false);
  EXPECT_EQ(run({"reset", "mine"}).first, 0);
  EXPECT_EQ(run({"delete", "mine"}).first, 0);
  EXPECT_TRUE(stateOf("mine").is_null());

  const auto refused = run({"delete", "small"});
  EXPECT_EQ(refused.first, 4);
  EXPECT_THAT(refused.second, HasSubstr("must be of a scene that was created"));
  EXPECT_EQ(run({"pause", "nowhere"}).first, 4);
  EXPECT_EQ(run({"create", "tests/e2e/nowhere.json"}).first, 2);
  EXPECT_EQ(run({"create"}).first, 2);
  // A scene that refers to a mesh file.
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "mesh.json";
  std::ofstream(file) << R"({"name": "m", "cloths": [{"name": "c", "mesh": {"file": "dress.obj"}}]})";
  const auto meshless = run({"create", file});
  EXPECT_EQ(meshless.first, 2);
  EXPECT_THAT(meshless.second, HasSubstr("print-scene"));
}

TEST_F(Join, CreateRepairsAMeshOnRequest) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "flap.json";
  // Three triangles meet at one edge.
  std::ofstream(file) << R"({"name": "flap", "cloths": [{"name": "sheet", "mesh": {
    "positions": [0,0,0, 1,0,0, 0,1,0, 0,-1,0, 0,0,1], "triangles": [0,1,2, 1,0,3, 0,1,4]}}]})";
  const auto create = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"create", file.string(), "--server", address_});
    auto client = clothstream(options);
    const int code = client->waitForEnd(kPatience).value_or(-1);
    return std::pair(code, std::move(client));
  };
  const auto refused = create({});
  EXPECT_EQ(refused.first, 4);
  EXPECT_THAT(refused.second->errors(), AllOf(HasSubstr("is not manifold"), HasSubstr("set \"repair\"")));
  const auto repaired = create({"--repair"});
  EXPECT_EQ(repaired.first, 0) << repaired.second->errors();
  EXPECT_EQ(repaired.second->output(), "flap\n");
  EXPECT_THAT(repaired.second->errors(), HasSubstr("sheet: "));
}

TEST_F(Join, ReportsServerThatIsKilled) {
  const auto client = clothstream({"join", address_, "--no-reconnect"}, Process::Output::terminal);
  ASSERT_TRUE(client->waitForOutput("fps", kPatience)) << client->errors();
  server_->signal(SIGKILL);
  EXPECT_EQ(client->waitForEnd(kPatience), 5);
  EXPECT_THAT(client->errors(), ContainsRegex("The (stream|server).*" + address_));
  EXPECT_THAT(client->output(), HasSubstr("bits a vertex")) << "the summary is printed nevertheless";
}

TEST_F(Join, ReportsServerThatStops) {
  const auto client = clothstream({"join", address_, "--no-reconnect"}, Process::Output::terminal);
  ASSERT_TRUE(client->waitForOutput("fps", kPatience)) << client->errors();
  server_->signal(SIGTERM);
  EXPECT_EQ(client->waitForEnd(kPatience), 5);
  EXPECT_THAT(client->errors(), HasSubstr("stop"));
}

TEST_F(Join, PrintsSummaryAfterInterrupt) {
  const auto client = clothstream({"join", address_}, Process::Output::terminal);
  // The live line, on a terminal.
  ASSERT_TRUE(client->waitForOutput("ms round trip", kPatience)) << client->errors();
  EXPECT_THAT(client->output(), ContainsRegex("small  tick [0-9]+  [0-9]+ fps  [0-9]+ kbit/s"));
  client->signal(SIGINT);
  EXPECT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  EXPECT_THAT(client->output(), HasSubstr("bits a vertex"));
}

TEST_F(Join, ListsTheScenes) {
  const auto table = clothstream({"list", address_});
  ASSERT_EQ(table->waitForEnd(kPatience), 0) << table->errors();
  EXPECT_THAT(table->output(), HasSubstr("small_with_normals"));
  EXPECT_THAT(table->output(), HasSubstr("curtain"));
  const auto list = clothstream({"list", address_, "--json"});
  ASSERT_EQ(list->waitForEnd(kPatience), 0) << list->errors();
  bool found = false;
  for (const auto& scene : nlohmann::json::parse(list->output())) {
    if (scene.at("name") != "small") continue;
    found = true;
    EXPECT_EQ(scene.at("vertices"), kVertices);
    EXPECT_EQ(scene.at("cloths"), 2);
  }
  EXPECT_TRUE(found);
}

// ---- Without a server

int run(std::vector<std::string> arguments, std::string& errors) {
  arguments.insert(arguments.begin(), CLOTHSTREAM);
  Process client(arguments);
  const int code = client.waitForEnd(kPatience).value_or(-1);
  errors = client.errors();
  EXPECT_THAT(client.output(), IsEmpty());
  return code;
}

TEST(JoinWithoutServer, ReportsThatNoServerAnswers) {
  std::string errors;
  // No program listens on port 1 of this machine.
  EXPECT_EQ(run({"join", "127.0.0.1:1", "--seconds", "1"}, errors), 3);
  EXPECT_THAT(errors, HasSubstr("No server answers at 127.0.0.1:1: is clothstream-server running there?"));
  EXPECT_EQ(run({"list", "127.0.0.1:1"}, errors), 3);
  EXPECT_THAT(errors, HasSubstr("is clothstream-server running there?"));
}

TEST(JoinWithoutServer, ReportsUnwritableFileBeforeJoining) {
  std::string errors;
  EXPECT_EQ(run({"join", "127.0.0.1:1", "--obj", "/nowhere/last.obj"}, errors), 6);
  EXPECT_THAT(errors, HasSubstr("cannot write /nowhere/last.obj: No such file or directory"));
  EXPECT_EQ(run({"join", "127.0.0.1:1", "--obj", "/tmp"}, errors), 6);
  EXPECT_THAT(errors, HasSubstr("cannot write /tmp: Is a directory"));
}

TEST(JoinWithoutServer, LeavesNoFileBehind) {
  const TemporaryDirectory directory;
  std::string errors;
  EXPECT_EQ(run({"join", "127.0.0.1:1", "--obj", directory.path() / "last.obj"}, errors), 3);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST_F(Join, PrintsReportsOfTheSimulation) {
  const auto client = clothstream({"join", address_, "--json", "--seconds", "2"});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  const auto cloths = nlohmann::json::parse(client->output())["cloths"];
  ASSERT_EQ(cloths.size(), 2u);
  for (const auto& cloth : cloths) {
    EXPECT_EQ(cloth["solver"], "massSpring");
    EXPECT_GT(cloth["tick"], 0);
    EXPECT_GE(cloth["strainMax"], cloth["strainP99"]);
    EXPECT_GT(cloth["strainMean"], 0);
    EXPECT_GT(cloth["elasticEnergy"], 0);
    EXPECT_EQ(cloth["activeConstraints"], 0);
    EXPECT_GE(cloth["penetration"], 0);
  }
  const auto reporting = clothstream({"join", address_, "--report"});
  EXPECT_TRUE(reporting->waitForOutput("% mean; energy", kPatience)) << reporting->errors();
  reporting->signal(SIGINT);
  EXPECT_EQ(reporting->waitForEnd(kPatience), 0);
}

TEST_F(Join, SetsParametersForAllClients) {
  const std::string cloth = [&] {
    const auto client = clothstream({"join", address_, "--json", "--seconds", "1"});
    EXPECT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
    return nlohmann::json::parse(client->output())["cloths"][0]["name"].get<std::string>();
  }();
  const auto set = clothstream({"set", address_, "--cloth", cloth, "--solver", "acad", "--activation", "0.02",
                                "--thickness", "0.02", "--wind", "0,0,-2"});
  ASSERT_EQ(set->waitForEnd(kPatience), 0) << set->errors();
  EXPECT_THAT(set->errors(), IsEmpty());
  const auto client = clothstream({"join", address_, "--json", "--seconds", "2"});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  const auto cloths = nlohmann::json::parse(client->output())["cloths"];
  EXPECT_EQ(cloths[0]["solver"], "acad");
  EXPECT_EQ(cloths[1]["solver"], "massSpring");

  const auto made = clothstream(
      {"set", "--cloth", cloth, "--material", "silk", "--friction", "0.9", "--gust", "2,0.5", address_});
  ASSERT_EQ(made->waitForEnd(kPatience), 0) << made->errors();
  const auto none = clothstream({"set", address_, "--material", "velvet"});
  EXPECT_EQ(none->waitForEnd(kPatience), 4);
  EXPECT_THAT(none->errors(), HasSubstr("must be one of cotton, denim"));

  const auto refused = clothstream({"set", address_, "--stiffness", "1e5"});
  EXPECT_EQ(refused->waitForEnd(kPatience), 4);
  EXPECT_THAT(refused->errors(), HasSubstr("substeps"));
  const auto unknown = clothstream({"set", address_, "--cloth", "rug", "--damping", "1"});
  EXPECT_EQ(unknown->waitForEnd(kPatience), 4);
  EXPECT_THAT(unknown->errors(), HasSubstr("'rug' does not exist in the scene"));
}

TEST(JoinWithoutServer, RefusesInvalidArguments) {
  std::string errors;
  EXPECT_EQ(run({"join", "127.0.0.1:port"}, errors), 2);
  EXPECT_THAT(errors, HasSubstr("has no valid port after the host; use 1 to 65535"));
  EXPECT_EQ(run({"join", "--seconds", "-1"}, errors), 2);
  EXPECT_EQ(run({"join", "--collider", "1,2"}, errors), 2);
  EXPECT_THAT(errors, HasSubstr("X,Y,Z or X,Y,Z,RADIUS"));
  EXPECT_EQ(run({"follow"}, errors), 2);
  EXPECT_EQ(run({"set"}, errors), 2);
  EXPECT_THAT(errors, HasSubstr("nothing to change"));
  EXPECT_EQ(run({"set", "--solver", "magic"}, errors), 2);
  EXPECT_EQ(run({"set", "--wind", "1,2"}, errors), 2);
}

}  // namespace
}  // namespace clothstream::e2e
