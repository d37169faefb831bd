// SPDX-License-Identifier: MIT
// The server program: what it says, what its options do, how it ends.
#include <csignal>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "tests/e2e/server_process.h"
#include "tests/stream/small_scene.h"
#include "tests/web/web_client.h"

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
              HasSubstr("there is no scene 'nowhere'; there are curtain, flag, obstacles, sphere_drop"));
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

TEST_F(ServerProgram, NamesTheDevicesThereAre) {
  ServerProcess list({"--list-devices"});
  EXPECT_EQ(list.exitCode(), 0);
  EXPECT_THAT(list.said(), HasSubstr("0  "));
  ServerProcess server(options({"--device", "no such device"}));
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.said(), HasSubstr("no such device"));
}

TEST_F(ServerProgram, ExplainsItsOptions) {
  ServerProcess help({"--help"});
  EXPECT_EQ(help.exitCode(), 0);
  for (const char* option : {"--scene", "--scene-file", "--rate", "--substeps", "--max-error", "--normals",
                             "--host", "--port", "--grpc-port", "--page", "--device", "--list-devices",
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
