// SPDX-License-Identifier: MIT
// `clothstream join --input` and `--events`, and `clothstream set` of colliders and attachments, against the
// real clothstream-server.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <memory>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "clients/cli/input_lines.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;

class JoinLines : public RunningServer {
 protected:
  std::unique_ptr<Process> clothstream(Arguments arguments) const {
    arguments.insert(arguments.begin(), CLOTHSTREAM);
    return std::make_unique<Process>(arguments);
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(directory_.path() / name) << text;
    return directory_.path() / name;
  }
  // Runs a command with this server to its end.
  std::pair<int, std::string> run(Arguments arguments) const {
    arguments.insert(arguments.end(), {"--server", address_});
    const auto client = clothstream(arguments);
    const int code = client->waitForEnd(kPatience).value_or(-1);
    return {code, client->output() + client->errors()};
  }

  TemporaryDirectory directory_;
};

std::vector<Json> linesOf(const std::string& output) {
  std::vector<Json> lines;
  std::istringstream text(output);
  for (std::string line; std::getline(text, line);) lines.push_back(Json::parse(line));
  return lines;
}

std::vector<std::string> namesOf(const std::vector<Json>& lines) {
  std::vector<std::string> names;
  for (const Json& line : lines) names.push_back(line.at("event"));
  return names;
}

TEST_F(JoinLines, InputTouchesClothAndCausesEvents) {
  startServer();
  if (IsSkipped()) return;
  // The box reaches into the right sheet, and leaves again. The grab takes the lower edge of the left sheet.
  const auto input = write("input", R"(
    {"colliders": [{"box": {"size": [0.3, 0.3, 0.3]}, "position": [0.5, 1.8, -0.1]}]}
    {"after": 0.5, "colliders": [], "grabs": [{"id": 7, "position": [-0.5, 1.2, 0], "reach": 1}]}
    {"after": 0.5, "grabs": []}
  )");
  const auto client = clothstream({"join", address_, "--events", "--frames", "--hash", "--input", input});
  EXPECT_TRUE(client->waitForOutput("grabReleased", kPatience)) << client->errors();
  EXPECT_EQ(run({"pause", "small"}).first, 0);
  EXPECT_TRUE(client->waitForOutput("\"notice\"", kPatience)) << client->errors();
  client->signal(SIGINT);
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();

  const std::vector<Json> lines = linesOf(client->output());
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.front().at("event"), "joined");
  EXPECT_EQ(lines.front().at("scene"), "small");
  EXPECT_EQ(lines.front().at("role"), "owner");
  const Json id = lines.front().at("id");
  EXPECT_EQ(lines.front().at("participants").at(0).at("id"), id);
  EXPECT_EQ(lines.back().at("event"), "summary");
  EXPECT_EQ(lines.back().at("hashMismatches"), 0);
  std::uint64_t newestTick = 0;
  bool began = false, ended = false, taken = false, released = false;
  for (const Json& line : lines) {
    const std::string event = line.at("event");
    if (event.starts_with("contact") && line.contains("participant")) {
      EXPECT_EQ(line.at("participant"), id);
      EXPECT_EQ(line.at("colliderId"), 0);
      EXPECT_EQ(line.at("cloth"), "right");
      EXPECT_GE(line.at("impulse"), 0);
      began = began || event == "contactBegan";
      ended = ended || event == "contactEnded";
    }
    if (event == "frame") {
      EXPECT_GT(line.at("tick"), newestTick);
      newestTick = line.at("tick");
      EXPECT_EQ(line.at("hash").get<std::string>().size(), 16u);
    }
    if (event.starts_with("grab")) {
      EXPECT_EQ(line.at("participant"), id);
      EXPECT_EQ(line.at("grab"), 7);
    }
    taken = taken || (event == "grabTaken" && line.at("vertices") > 0);
    released = released || event == "grabReleased";
  }
  EXPECT_GT(newestTick, 0u);
  EXPECT_TRUE(began && ended && taken && released) << client->output();
}

TEST_F(JoinLines, EventsSayThatAColliderYields) {
  startServer({"--scene", "layers", "--scene-file", "tests/e2e/layers.json"});
  if (IsSkipped()) return;
  // A plate is put 2 cm into the ground, in steps, and lifted two seconds later.
  const auto plateAt = [](double after, double lowerSide) {
    return fmt::format(
        R"({{"after": {}, "colliders": [{{"box": {{"size": [0.4, 0.1, 0.4]}}, "position": [0, {}, 0]}}]}})"
        "\n",
        after, lowerSide + 0.05);
  };
  std::string lines;
  for (int step = 0; step < 20; ++step) lines += plateAt(0.05, 0.17 - 0.01 * step);
  const auto input = write("input", lines + plateAt(2, 0.3));
  const auto client = clothstream({"join", address_, "--events", "--input", input});
  EXPECT_TRUE(client->waitForOutput("colliderFollows", kPatience)) << client->errors();
  client->signal(SIGINT);
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  const std::vector<Json> events = linesOf(client->output());
  const auto yields =
      std::ranges::find(events, "colliderYields", [](const Json& line) { return line.at("event"); });
  ASSERT_NE(yields, events.end()) << client->output();
  EXPECT_EQ(yields->at("participant"), events.front().at("id"));
  EXPECT_EQ(yields->at("colliderId"), 0);
  EXPECT_GT(events.back().at("seconds").get<double>() - yields->at("seconds").get<double>(), 1.5)
      << "the plate followed before it was lifted: " << client->output();
}

TEST_F(JoinLines, CommandsAcceptAsManyVerticesAsAllowed) {
  startServer();
  if (IsSkipped()) return;
  const std::vector<Arguments> commands{{"join", address_, "--seconds", "0.1"},
                                        {"set", address_, "--gravity", "0,-5,0"},
                                        {"participants", "small", "--server", address_},
                                        {"load", address_, "--participants", "1", "--seconds", "0.1"}};
  for (Arguments arguments : commands) {
    arguments.insert(arguments.end(), {"--max-vertices", "9"});
    const auto refused = clothstream(arguments);
    EXPECT_NE(refused->waitForEnd(kPatience), 0) << arguments[0];
    EXPECT_THAT(refused->errors(), HasSubstr("vertices")) << arguments[0];
    arguments.back() = "16777216";
    const auto accepted = clothstream(arguments);
    EXPECT_EQ(accepted->waitForEnd(kPatience), 0) << arguments[0] << ": " << accepted->errors();
  }
}

TEST_F(JoinLines, EventsReportJoinsChangesAndLeaves) {
  startServer();
  if (IsSkipped()) return;
  const auto watcher = clothstream({"join", address_, "--events", "--name", "Ada"});
  ASSERT_TRUE(watcher->waitForOutput("joined", kPatience)) << watcher->errors();
  const auto guest = clothstream({"join", address_, "--events", "--name", "Ben"});
  ASSERT_TRUE(guest->waitForOutput("joined", kPatience)) << guest->errors();
  const auto set = clothstream({"set", address_, "--gravity", "0,-5,0"});
  EXPECT_EQ(set->waitForEnd(kPatience), 0) << set->errors();
  ASSERT_TRUE(guest->waitForOutput("parametersChanged", kPatience)) << guest->errors();
  const auto listed = run({"participants", "small", "--json"});
  ASSERT_EQ(listed.first, 0) << listed.second;
  const Json participants = Json::parse(listed.second);
  ASSERT_EQ(participants.size(), 2u);
  EXPECT_EQ(participants[0].at("name"), "Ada");
  EXPECT_EQ(participants[0].at("role"), "owner");
  EXPECT_EQ(participants[1].at("name"), "Ben");
  EXPECT_THAT(run({"participants", "small"}).second, HasSubstr("participant   Ben"));
  guest->signal(SIGTERM);
  EXPECT_EQ(guest->waitForEnd(kPatience), 0);
  ASSERT_TRUE(watcher->waitForOutput("participantLeft\",\"seconds\"", kPatience));
  EXPECT_TRUE(eventually([&] {
    watcher->waitForOutput("never printed", 100ms);
    return watcher->output().find(
               R"("name":"Ben","client":"clothstream join","role":"participant","away":false}})",
               watcher->output().rfind("participantLeft")) != std::string::npos;
  })) << watcher->output();
  watcher->signal(SIGTERM);
  EXPECT_EQ(watcher->waitForEnd(kPatience), 0);
  const std::vector<std::string> events = namesOf(linesOf(watcher->output()));
  EXPECT_THAT(events, Contains("participantJoined"));
  EXPECT_THAT(events, Contains("parametersChanged"));
}

TEST_F(JoinLines, SetMovesColliderAndAttachment) {
  const auto scene = write("rod.json", R"({"name": "rod", "cloths": [{"name": "flag",
    "grid": {"rows": 5, "columns": 5, "width": 0.4, "height": 0.4, "pose": {"position": {"y": 1.4}}},
    "attachments": [{"name": "pole", "pose": {"position": {"y": 1.4}}, "ranges": [{"firstRow": 0, "firstColumn": 0, "lastColumn": 4}]}]}],
    "colliders": [{"name": "ball", "sphere": {"radius": 0.1}, "pose": {"position": {"z": 3}}}]})");
  startServer({"--scene", "rod", "--scene-file", scene});
  if (IsSkipped()) return;
  const auto moved = clothstream({"set", address_, "--attachment", "pole", "--position", "1,2,0", "--jump"});
  EXPECT_EQ(moved->waitForEnd(kPatience), 0) << moved->errors();
  const auto ball =
      clothstream({"set", address_, "--collider", "ball", "--position", "0,0.5,2", "--radius", "0.25"});
  EXPECT_EQ(ball->waitForEnd(kPatience), 0) << ball->errors();
  const auto heavy = clothstream({"set", address_, "--areal-mass", "0.5"});
  EXPECT_EQ(heavy->waitForEnd(kPatience), 0) << heavy->errors();
  const auto unknown = clothstream({"set", address_, "--attachment", "mast", "--position", "1,2,0"});
  EXPECT_EQ(unknown->waitForEnd(kPatience), 4);
  EXPECT_THAT(unknown->errors(), HasSubstr("pole"));
  const auto noBall = clothstream({"set", address_, "--collider", "cube", "--radius", "0.25"});
  EXPECT_EQ(noBall->waitForEnd(kPatience), 4);
  EXPECT_THAT(noBall->errors(), HasSubstr("ball"));

  const auto printed = run({"print-scene", "rod"});
  ASSERT_EQ(printed.first, 0) << printed.second;
  const Json definition = Json::parse(printed.second);
  EXPECT_EQ(definition.at("colliders").at(0).at("sphere").at("radius"), 0.25);
  EXPECT_EQ(definition.at("colliders").at(0).at("pose").at("position").at("z"), 2.0);
  EXPECT_NEAR(definition.at("cloths").at(0).at("mass").get<double>(), 0.5 * 0.4 * 0.4, 1e-6);
  // The scene that is printed can be created again.
  const auto file = write("again.json", printed.second);
  EXPECT_EQ(run({"create", file, "--name", "again"}).first, 0);

  // The upper edge is at the new place of the pole, with an error of at most 0.5 mm along each axis.
  const std::filesystem::path obj = directory_.path() / "moved.obj";
  const auto client = clothstream({"join", address_, "--seconds", "1", "--obj", obj});
  ASSERT_EQ(client->waitForEnd(kPatience), 0) << client->errors();
  std::ifstream vertices(obj);
  std::string word;
  double x = 0, y = 0, z = 0;
  while (vertices >> word && word != "v") vertices.ignore(1'000, '\n');
  ASSERT_TRUE(vertices >> x >> y >> z);
  EXPECT_NEAR(y, 2, 0.001);
  EXPECT_NEAR(std::abs(x - 1), 0.2, 0.001);
}

TEST_F(JoinLines, WrongLineEndsTheProgramWithItsNumber) {
  startServer();
  if (IsSkipped()) return;
  const auto input = write("wrong", "{\"colliders\": []}\n\n{\"head\": {\"position\": [1, 2]}}\n");
  const auto client = clothstream({"join", address_, "--input", input});
  EXPECT_EQ(client->waitForEnd(kPatience), 7);
  EXPECT_THAT(client->errors(), HasSubstr("wrong, line 3: head.position must be an array of 3 numbers"));
}

// ---- Without a server

TEST(InputLines, ErrorsNameThePartThatIsWrong) {
  const auto errorOf = [](std::string_view line) {
    const auto parsed = cli::parseInputLine(line);
    return parsed ? std::string() : parsed.error();
  };
  EXPECT_EQ(errorOf("{"), "is not JSON");
  EXPECT_EQ(errorOf("[]"), "a line must be an object");
  EXPECT_EQ(
      errorOf(R"({"collider": []})"),
      "\"collider\" is not a key of a line; use after, colliders, grabs, head, hands, attachments, joints, "
      "wear, body");
  EXPECT_EQ(errorOf(R"({"after": -1})"), "after must be 0 to 86400 s");
  EXPECT_EQ(errorOf(R"({"colliders": [{"position": [0, 0, 0]}]})"),
            "colliders[0] must have one of \"sphere\", \"capsule\" and \"box\"");
  EXPECT_EQ(errorOf(R"({"colliders": [{"sphere": {"radius": 1}}]})"), "colliders[0] has no \"position\"");
  EXPECT_EQ(errorOf(R"({"colliders": [{"capsule": {"radius": 1}, "position": [0, 0, 0]}]})"),
            "colliders[0].capsule has no \"length\"");
  EXPECT_EQ(errorOf(R"({"colliders": [{"sphere": 1, "position": [0, 0, 0]}]})"),
            "colliders[0].sphere must be an object");
  EXPECT_EQ(errorOf(R"({"head": {"position": [0, 1e40, 0]}})"), "head.position must be a number");
  EXPECT_EQ(errorOf(R"({"grabs": [{"id": -1, "position": [0, 0, 0]}]})"),
            "grabs[0].id must be an integer, 0 to 4294967295");
  EXPECT_EQ(errorOf(R"({"hands": {"left": [[0, 0, 0, 1]]}})"),
            "hands.left has 1 joints; use 26 (OpenXR) or 25 (WebXR)");
  EXPECT_EQ(errorOf(R"({"wear": 3})"),
            "wear must be the name of a collider, or null, which gives the body back");
  EXPECT_EQ(errorOf(R"({"body": {"floor": 1}})"), "body has no \"head\"");
  EXPECT_EQ(errorOf(R"({"body": {"head": {"position": [0, 1, 0]}, "hips": [1, 2]}})"),
            "body.hips must be an array of 3 numbers");
  EXPECT_EQ(errorOf(R"({"attachments": [{"position": [0, 0, 0]}]})"),
            "attachments[0] must have a \"name\", a text");
  EXPECT_EQ(errorOf(R"({"attachments": [{"name": "rod", "position": [0, 0, 0], "jumps": 1}]})"),
            "attachments[0].jumps must be true or false");
  std::string many = R"({"colliders": [)";
  for (int i = 0; i < 41; ++i) many += std::string(i == 0 ? "" : ",") + "{}";
  EXPECT_EQ(errorOf(many + "]}"), "colliders has 41 elements; at most 40 are allowed");
}

TEST(InputLines, LinesWaitForTheirTime) {
  const TemporaryDirectory directory;
  const std::filesystem::path path = directory.path() / "lines";
  std::ofstream(path) << "{\"head\": null}\n{\"after\": 2, \"colliders\": []}\n{\"grabs\": []}";
  auto lines = cli::InputLines::open(path);
  ASSERT_TRUE(lines) << lines.error();
  const std::chrono::steady_clock::time_point start;
  const auto next = [&](std::chrono::milliseconds after) { return lines->next(start + after).value(); };
  const auto first = next(0ms);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->head.has_value());
  EXPECT_FALSE(next(1999ms).has_value());
  const auto second = next(2500ms);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->colliders.has_value());
  EXPECT_FALSE(lines->atEnd());
  EXPECT_TRUE(next(2500ms)->grabs.has_value()) << "the last line has no line break";
  EXPECT_FALSE(next(2500ms).has_value());
  EXPECT_TRUE(lines->atEnd());
}

TEST(InputLines, LongLineIsRefusedBeforeItIsParsed) {
  const TemporaryDirectory directory;
  const std::filesystem::path path = directory.path() / "long";
  std::ofstream(path) << "{}\n" << std::string(200'000, ' ') << "{}";
  auto lines = cli::InputLines::open(path);
  ASSERT_TRUE(lines) << lines.error();
  const std::chrono::steady_clock::time_point now;
  EXPECT_TRUE(lines->next(now).value().has_value());
  std::string error;
  for (int i = 0; i < 10 && error.empty(); ++i)
    if (const auto line = lines->next(now); !line) error = line.error();
  EXPECT_THAT(error, HasSubstr("line 2: has more than 65536 bytes"));
}

TEST(InputLines, MissingFileIsReportedBeforeJoining) {
  Process client({CLOTHSTREAM, "join", "127.0.0.1:1", "--input", "/nowhere/lines"});
  EXPECT_EQ(client.waitForEnd(kPatience), 7);
  EXPECT_THAT(client.errors(), HasSubstr("cannot read /nowhere/lines: No such file or directory"));
  EXPECT_THAT(client.output(), IsEmpty());
}

}  // namespace
}  // namespace clothstream::e2e
