// SPDX-License-Identifier: MIT
// The server program: what it says, what its options do, how it ends.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/messages/scene_file.h"
#include "tests/e2e/server_process.h"
#include "tests/endpoint/web_client.h"
#include "tests/serving/small_scene.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;

// A small scene in a file of the test's own, so that a busy machine can keep up.
class ServerProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::temp_directory_path() /
                 (std::string("clothstream-") + info->name() + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
    std::ofstream(sceneFile()) << messages::toJson(smallScene("small"));
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path sceneFile() const { return directory_ / "small.json"; }
  std::vector<std::string> options(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{
        "--scene-file", sceneFile(),         "--scene", "small", "--port", "0", "--grpc-port", "0",
        "--cache-dir",  directory_ / "cache"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

 private:
  std::filesystem::path directory_;
};

TEST_F(ServerProgram, SaysDeviceScenesAndAddressesAndStreams) {
  ServerProcess server(options());
  EXPECT_THAT(server.lineWith("device"), HasSubstr("Vulkan"));
  EXPECT_THAT(server.lineWith("scenes"),
              testing::AllOf(HasSubstr("curtain (4096 vertices)"), HasSubstr("flag ("),
                             HasSubstr("sphere_drop ("), HasSubstr("small (120 vertices)")));
  const std::uint16_t port = server.portIn(server.lineWith("page    http://127.0.0.1:"));
  EXPECT_GT(server.portIn(server.lineWith("gRPC    127.0.0.1:")), 0);

  WebSocketClient client(port);
  client.send(hello());
  Viewer viewer;
  ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 10; }));
  EXPECT_EQ(viewer.welcome.scene(), "small");
  EXPECT_THAT(viewer.welcome.server_name(), HasSubstr("clothstream-server 0."));

  server.signal(SIGUSR1);
  server.lineWith("scene small (ms)");
  EXPECT_THAT(server.lineWith("tick lateness"), HasSubstr("."));
  server.signal(SIGTERM);
  EXPECT_FALSE(client.watch(viewer, [] { return false; }));
  ASSERT_FALSE(viewer.notices.empty());
  EXPECT_EQ(viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
  EXPECT_EQ(server.exitCode(), 0) << server.said();
  EXPECT_THAT(server.said().substr(server.said().rfind("scene small (ms)")), HasSubstr("joins 1"));
}

TEST_F(ServerProgram, StopsByItselfAndOnInterrupt) {
  EXPECT_EQ(ServerProcess(options({"--seconds", "0.2"})).exitCode(), 0);
  ServerProcess interrupted(options());
  interrupted.lineWith("gRPC");
  interrupted.signal(SIGINT);
  EXPECT_EQ(interrupted.exitCode(), 0) << interrupted.said();
}

TEST_F(ServerProgram, RunsTheSceneAtTheRateItIsTold) {
  ServerProcess server(
      options({"--rate", "50", "--substeps", "16", "--max-error", "0.002", "--normals", "octahedral"}));
  WebSocketClient client(server.portIn(server.lineWith("page    http://")));
  client.send(hello());
  Viewer viewer;
  ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 2; }));
  EXPECT_EQ(viewer.description.simulation_rate(), 50u);
  EXPECT_EQ(viewer.description.stream_rate(), 25u);  // the largest divisor of 50 up to the scene's own 40
  EXPECT_EQ(viewer.description.definition().substeps(), 16u);
  EXPECT_EQ(viewer.description.normals(), v1::NORMALS_OCTAHEDRAL);
  EXPECT_FLOAT_EQ(viewer.description.max_error(), 0.002f);
}

TEST_F(ServerProgram, NamesThePortAndTheOptionWhenAPortIsInUse) {
  ServerProcess first(options());
  const std::string page = std::to_string(first.portIn(first.lineWith("page    http://")));
  const std::string grpc = std::to_string(first.portIn(first.lineWith("gRPC    ")));
  ServerProcess samePage(options({"--port", page}));
  EXPECT_EQ(samePage.exitCode(), 1);
  EXPECT_THAT(samePage.said(), testing::AllOf(HasSubstr("port " + page), HasSubstr("--port")));
  ServerProcess sameGrpc(options({"--grpc-port", grpc}));
  EXPECT_EQ(sameGrpc.exitCode(), 1);
  EXPECT_THAT(sameGrpc.said(), testing::AllOf(HasSubstr("port " + grpc), HasSubstr("--grpc-port")));
}

TEST_F(ServerProgram, NamesTheScenesThereAre) {
  ServerProcess server({"--scene", "nowhere"});
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.said(),
              HasSubstr("there is no scene 'nowhere'; there are curtain, figure_07, figure_09"));
}

TEST_F(ServerProgram, NamesTheSubstepsThatWouldDo) {
  ServerProcess server(options({"--substeps", "1"}));
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.said(), HasSubstr("scene 'small' with these options: substeps"));
}

TEST_F(ServerProgram, SaysWhereASceneFileIsWrong) {
  std::ofstream(sceneFile()) << "{\"name\": \"small\", ";
  ServerProcess server(options());
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.said(), HasSubstr("small.json"));
  ServerProcess missing({"--scene-file", "/nowhere/scene.json"});
  EXPECT_EQ(missing.exitCode(), 1);
  EXPECT_THAT(missing.said(), HasSubstr("/nowhere/scene.json"));
}

std::vector<float> numbersIn(const std::filesystem::path& path) {
  std::vector<float> numbers(std::filesystem::file_size(path) / sizeof(float));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(numbers.data()),
            static_cast<std::streamsize>(numbers.size() * sizeof(float)));
  return numbers;
}

// Two runs write the same bytes, whatever is left out between.
TEST_F(ServerProgram, StepsASceneIntoAFileThatOthersCanRead) {
  const std::filesystem::path whole = sceneFile().replace_filename("whole.f32");
  const std::filesystem::path some = sceneFile().replace_filename("some.f32");
  std::ofstream(some.string() + ".json") << "of a former run";
  ServerProcess every({"step", "--scene", sceneFile(), "--ticks", "20", "--out", whole});
  EXPECT_EQ(every.exitCode(), 0) << every.said();
  ServerProcess fifth({"step", "--scene", sceneFile(), "--ticks", "20", "--out", some, "--every", "5"});
  EXPECT_EQ(fifth.exitCode(), 0) << fifth.said();

  const model::Scene scene = smallScene("small");
  const std::size_t frame = std::size_t{scene.nodeCount()} * 6;
  const std::vector<float> all = numbersIn(whole), few = numbersIn(some);
  ASSERT_EQ(all.size(), 21 * frame);
  ASSERT_EQ(few.size(), 5 * frame);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_TRUE(std::equal(few.begin() + static_cast<std::ptrdiff_t>(i * frame),
                           few.begin() + static_cast<std::ptrdiff_t>((i + 1) * frame),
                           all.begin() + static_cast<std::ptrdiff_t>(5 * i * frame)))
        << "frame " << i;
  // Frame 0 is the start: at rest, the first node at its corner. Later ones fall.
  EXPECT_EQ(few[0], -0.45f);
  EXPECT_EQ(few[3], 0);
  EXPECT_LT(few[4 * frame + 6 * 115 + 1], few[6 * 115 + 1]);

  const auto said = nlohmann::json::parse(std::ifstream(some.string() + ".json"));
  EXPECT_EQ(said["shape"], (std::vector<std::size_t>{5, 120, 6}));
  EXPECT_EQ(said["dtype"], "<f4");
  EXPECT_EQ(said["file"], "some.f32");
  EXPECT_EQ(said["complete"], true);
  EXPECT_EQ(said["ticks"], (std::vector<int>{0, 5, 10, 15, 20}));
  EXPECT_EQ(said["hashes"].size(), 5u);
  EXPECT_EQ(said["cloths"][0]["name"], "sheet");
  EXPECT_EQ(said["cloths"][0]["rows"], 12);
  EXPECT_TRUE(said["reports"][0].is_null());
  const auto& report = said["reports"][4]["cloths"][0];
  EXPECT_GT(report["strainMax"], 0);
  EXPECT_GT(report["kineticEnergy"], 0);
  EXPECT_GE(report["penetration"], 0);
  EXPECT_EQ(said["scene"]["cloths"][0]["grid"]["columns"], 10);
  EXPECT_THAT(said["server"].get<std::string>(), HasSubstr("clothstream-server 0."));
}

// What docs/simulation.md shows, with what Python always has.
TEST_F(ServerProgram, WritesWhatPythonReads) {
  const std::filesystem::path out = sceneFile().replace_filename("state.f32");
  ServerProcess server({"step", "--scene", sceneFile(), "--ticks", "8", "--every", "4", "--out", out});
  ASSERT_EQ(server.exitCode(), 0) << server.said();
  const std::filesystem::path script = sceneFile().replace_filename("read.py");
  std::ofstream(script) << R"(
import array, json, sys
said = json.load(open(sys.argv[1] + '.json'))
frames, nodes, columns = said['shape']
numbers = array.array('f')
numbers.fromfile(open(sys.argv[1], 'rb'), frames * nodes * columns)
assert (frames, nodes, columns) == (3, 120, 6) and said['columns'][1] == 'py'
height = lambda frame: sum(numbers[(frame * nodes + node) * columns + 1] for node in range(nodes)) / nodes
assert height(2) < height(1) < height(0), 'it falls'
energy = [sum(report['cloths'][0][kind] for kind in ('kineticEnergy', 'elasticEnergy', 'gravityEnergy'))
          for report in said['reports'][1:]]
assert len(energy) == 2
)";
  const std::string command = "python3 '" + script.string() + "' '" + out.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST_F(ServerProgram, LeavesAValidFileWhenAStepIsInterrupted) {
  const std::filesystem::path out = sceneFile().replace_filename("long.f32");
  ServerProcess server(
      {"step", "--scene", sceneFile(), "--ticks", "100000000", "--every", "3", "--out", out});
  server.lineWith("tick ");  // says how far it is
  server.signal(SIGINT);
  EXPECT_EQ(server.exitCode(), 130);
  EXPECT_THAT(server.said(), HasSubstr("interrupted after tick"));
  const auto said = nlohmann::json::parse(std::ifstream(out.string() + ".json"));
  EXPECT_EQ(said["complete"], false);
  const std::size_t frames = said["shape"][0];
  EXPECT_GT(frames, 1u);
  EXPECT_EQ(std::filesystem::file_size(out), frames * 120 * 6 * sizeof(float));
  EXPECT_EQ(said["ticks"].size(), frames);
  EXPECT_EQ(said["reports"].size(), frames);
}

TEST_F(ServerProgram, SaysWhatIsWrongWithAStep) {
  const auto fails = [](const std::vector<std::string>& options, const std::string& text) {
    ServerProcess server(options);
    EXPECT_EQ(server.exitCode(), 1) << server.said();
    EXPECT_THAT(server.said(), HasSubstr(text));
  };
  const std::string file = sceneFile(), out = sceneFile().replace_filename("x.f32");
  fails({"step", "--scene", file, "--ticks", "1"}, "--out");
  fails({"step", "--scene", file, "--ticks", "0", "--out", out}, "--ticks");
  fails({"step", "--scene", "nowhere", "--ticks", "1", "--out", out}, "nowhere");
  fails({"step", "--scene", file, "--ticks", "1", "--out", "/nowhere/x.f32"}, "cannot write /nowhere/x.f32");
  fails({"step", "--scene", file, "--ticks", "1", "--out", out, "--substeps", "1"}, "substeps");
  ServerProcess help({"step", "--help"});
  EXPECT_EQ(help.exitCode(), 0);
  for (const char* word : {"--scene", "--ticks", "--out", "--every", "--device", "numpy"})
    EXPECT_THAT(help.said(), HasSubstr(word));
}

TEST_F(ServerProgram, NamesTheDevicesThereAre) {
  ServerProcess list({"--list-devices"});
  EXPECT_EQ(list.exitCode(), 0);
  EXPECT_THAT(list.said(), HasSubstr("0  "));
  ServerProcess server(options({"--device", "no such device"}));
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.said(), HasSubstr("no such device"));
}

TEST_F(ServerProgram, NamesTheMaterialsThereAre) {
  ServerProcess list({"--list-materials"});
  EXPECT_EQ(list.exitCode(), 0);
  for (const char* word : {"cotton", "wool", "0.324", "denim"}) EXPECT_THAT(list.said(), HasSubstr(word));
}

TEST_F(ServerProgram, ExplainsItsOptions) {
  ServerProcess help({"--help"});
  EXPECT_EQ(help.exitCode(), 0);
  for (const char* option :
       {"--scene", "--scene-file", "--rate", "--substeps", "--max-error", "--normals", "--reports", "step",
        "--host", "--port", "--grpc-port", "--page", "--device", "--list-devices", "--list-materials",
        "--software-threads", "--log-level", "--seconds"})
    EXPECT_THAT(help.said(), HasSubstr(option));
  ServerProcess version({"--version"});
  EXPECT_EQ(version.exitCode(), 0);
  EXPECT_THAT(version.said(), HasSubstr("clothstream-server 0."));
  ServerProcess wrong({"--speed", "3"});
  EXPECT_EQ(wrong.exitCode(), 1);
  EXPECT_THAT(wrong.said(), HasSubstr("--speed"));
  ServerProcess level(options({"--log-level", "loud"}));
  EXPECT_EQ(level.exitCode(), 1);
  EXPECT_THAT(level.said(), HasSubstr("loud"));
}

}  // namespace
}  // namespace clothstream::tests
