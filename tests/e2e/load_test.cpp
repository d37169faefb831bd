// SPDX-License-Identifier: MIT
// Runs `clothstream load` against both endpoints of the real clothstream-server.
#include <array>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr auto kEnd = 120s;

class Load : public RunningServer {
 protected:
  static std::unique_ptr<Process> load(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {CLOTHSTREAM, "load"});
    return std::make_unique<Process>(arguments);
  }
  // Scenes of the server that clients have created.
  std::size_t createdScenes() const {
    Process list({CLOTHSTREAM, "list", address_, "--json"});
    EXPECT_EQ(list.waitForEnd(kEnd), 0) << list.errors();
    std::size_t count = 0;
    for (const auto& scene : nlohmann::json::parse(list.output())) count += scene.at("created") == true;
    return count;
  }
  // Two participants move and decode. The stages of their poses add up to the total.
  static void expectPosesAreTimed(const nlohmann::json& report) {
    ASSERT_GT(report.at("poses").get<int>(), 10);
    double sum = 0;
    for (const char* stage : {"poseToTick", "tickToPacket", "packetToDecoded", "decodedToDisplayable"}) {
      const auto ms = [&](const char* what) {
        return report.at(std::string(stage) + "Ms" + what).get<double>();
      };
      // The estimate of the server's clock may be off by a few milliseconds.
      EXPECT_GT(ms("P50"), -5) << stage;
      EXPECT_GE(ms("P99"), ms("P50")) << stage;
      sum += ms("Mean");
    }
    EXPECT_GT(report.at("tickToPacketMsP50").get<double>(), 0);
    EXPECT_GE(report.at("decodedToDisplayableMsP50").get<double>(), 0);
    EXPECT_GE(report.at("poseToDisplayableMsP99"), report.at("poseToDisplayableMsP50"));
    // Sums of floats of up to a few seconds.
    EXPECT_NEAR(report.at("poseToDisplayableMsMean").get<double>(), sum, 0.01);
  }
  // Runs participants of every kind.
  void expectAllAreServed(const std::vector<std::string>& endpoint) {
    std::vector<std::string> arguments{
        "--participants", "6", "--viewers",   "2",    "--decoders",   "3",
        "--slow",         "1", "--slow-rate", "2000", "--intruders",  "5",
        "--leaves",       "2", "--seconds",   "4",    "--server-pid", std::to_string(server_->id()),
        "--json"};
    arguments.insert(arguments.end(), endpoint.begin(), endpoint.end());
    const auto program = load(arguments);
    ASSERT_EQ(program->waitForEnd(kEnd), 0) << program->errors();
    const auto report = nlohmann::json::parse(program->output());
    EXPECT_EQ(report.at("participants"), 6);
    EXPECT_GE(report.at("seconds").get<double>(), 4);
    EXPECT_GT(report.at("framesPerSecond").get<double>(), 1);
    EXPECT_LT(report.at("framesPerSecond").get<double>(), 2 * 60);
    // Both programs use the same clock, so an age may be negative only by the error of the estimate.
    EXPECT_GT(report.at("frameAgeMsP50").get<double>(), -5);
    EXPECT_GE(report.at("frameAgeMsP99"), report.at("frameAgeMsP50"));
    EXPECT_GT(report.at("tickAgeMsP50"), report.at("frameAgeMsP50"));
    EXPECT_EQ(report.at("decodeErrors"), 0);
    EXPECT_EQ(report.at("hashMismatches"), 0);
    EXPECT_GT(report.at("mbitPerSecond").get<double>(), 0);
    EXPECT_GT(report.at("serverCpuSeconds").get<double>(), 0);
    EXPECT_EQ(report.at("lost"), 0);
    EXPECT_GE(report.at("left").get<int>(), 2);
    EXPECT_GE(report.at("joined").get<int>(), 7);
    EXPECT_LT(report.at("slowFramesPerSecond"), report.at("framesPerSecond"));
    EXPECT_GE(report.at("intrusions").get<int>(), 5);
    expectPosesAreTimed(report);
  }
};

TEST_F(Load, GrpcServesParticipantsAmongHostileClients) {
  startServer();
  if (!address_.empty()) expectAllAreServed({address_});
}

TEST_F(Load, WebSocketServesParticipantsAmongHostileClients) {
  startServer();
  if (!web_.empty()) expectAllAreServed({"--web", web_});
}

// Takes about five seconds, most of them for measuring.
TEST_F(Load, CreatesScenesAndDeletesThem) {
  startServer({"--scene", "small", "--scene-file", "tests/e2e/small.json", "--max-created-scenes", "3"});
  if (address_.empty()) return;
  const Arguments scenes{"--scenes", "3", "--nodes", "64"};
  for (const Arguments& endpoint : {Arguments{address_}, Arguments{"--web", web_}}) {
    Arguments arguments{"--seconds", "1", "--json"};
    arguments.insert(arguments.end(), scenes.begin(), scenes.end());
    arguments.insert(arguments.end(), endpoint.begin(), endpoint.end());
    const auto program = load(arguments);
    ASSERT_EQ(program->waitForEnd(kEnd), 0) << program->errors();
    const auto report = nlohmann::json::parse(program->output());
    EXPECT_EQ(report.at("participants"), 3);
    EXPECT_EQ(report.at("joined"), 3);
    EXPECT_EQ(report.at("poses"), 0);
    EXPECT_EQ(report.at("scenesCreated"), 3);
    EXPECT_EQ(report.at("scenesNotDeleted"), 0);
    EXPECT_GT(report.at("slowestFramesPerSecond").get<double>(), 0);
    EXPECT_GE(report.at("medianFramesPerSecond"), report.at("slowestFramesPerSecond"));
    EXPECT_GT(report.at("firstFrameMsP50").get<double>(), 0);
    EXPECT_GE(report.at("firstFrameMsP99"), report.at("firstFrameMsP50"));
    EXPECT_EQ(report.at("decodeErrors").get<int>() + report.at("hashMismatches").get<int>(), 0);
    EXPECT_EQ(createdScenes(), 0u);
  }

  const auto crowd = load({address_, "--scenes", "4", "--nodes", "64"});
  EXPECT_EQ(crowd->waitForEnd(kEnd), 4);
  EXPECT_THAT(crowd->errors(), HasSubstr("3 of 4 scenes were created"));
  EXPECT_THAT(crowd->errors(), HasSubstr("created scenes, its maximum"));
  EXPECT_EQ(createdScenes(), 0u);

  const auto interrupted = load({address_, "--scenes", "2", "--nodes", "64", "--seconds", "3600"});
  EXPECT_TRUE(eventually([&] { return createdScenes() == 2; }));
  interrupted->signal(SIGINT);
  EXPECT_EQ(interrupted->waitForEnd(kEnd), 0) << interrupted->errors();
  EXPECT_EQ(createdScenes(), 0u);
}

TEST_F(Load, ReportsNoLatencyWithoutPoses) {
  startServer();
  if (address_.empty()) return;
  const auto program = load({address_, "--participants", "2", "--viewers", "2", "--seconds", "1", "--json"});
  ASSERT_EQ(program->waitForEnd(kEnd), 0) << program->errors();
  const auto report = nlohmann::json::parse(program->output());
  EXPECT_EQ(report.at("poses"), 0);
  EXPECT_TRUE(report.at("poseToDisplayableMsP50").is_null());
  EXPECT_TRUE(report.at("decodedToDisplayableMsP99").is_null());
}

// The first participant moves, the second only looks.
TEST_F(Load, WritesLineForEachFrame) {
  startServer();
  if (address_.empty()) return;
  const TemporaryDirectory directory;
  const std::string path = directory.path() / "frames";
  const auto program =
      load({address_, "--participants", "2", "--viewers", "1", "--seconds", "1", "--frames", path});
  ASSERT_EQ(program->waitForEnd(kEnd), 0) << program->errors();
  std::array<std::uint64_t, 2> frames{}, newest{};
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const auto frame = nlohmann::json::parse(line);
    const auto participant = frame.at("participant").get<std::size_t>();
    ++frames.at(participant);
    EXPECT_GE(frame.at("seconds").get<double>(), 0);
    EXPECT_GT(frame.at("tick").get<std::uint64_t>(), newest.at(participant));
    newest.at(participant) = frame.at("tick").get<std::uint64_t>();
    if (participant == 1) {
      EXPECT_TRUE(frame.at("displayableMs").is_null());
    } else if (frames[0] > 1) {
      EXPECT_GE(frame.at("displayableMs"), frame.at("ageMs"));
    }
  }
  for (const std::uint64_t count : frames) EXPECT_GT(count, 10u);

  const auto elsewhere = load({address_, "--frames", directory.path() / "missing" / "frames"});
  EXPECT_EQ(elsewhere->waitForEnd(kEnd), 6);
  EXPECT_THAT(elsewhere->errors(), HasSubstr("missing"));
}

TEST_F(Load, ReportsWhyParticipantsWereRefused) {
  startServer({"--scene", "small", "--scene-file", "tests/e2e/small.json", "--max-participants", "3"});
  if (address_.empty()) return;
  const auto crowd = load({address_, "--participants", "4"});
  EXPECT_EQ(crowd->waitForEnd(kEnd), 4);
  EXPECT_THAT(crowd->errors(), HasSubstr("1 participants were refused or disconnected"));
  EXPECT_THAT(crowd->errors(), HasSubstr("has 3 participants"));

  const auto elsewhere = load({address_, "--scene", "nowhere"});
  EXPECT_EQ(elsewhere->waitForEnd(kEnd), 4);
  EXPECT_THAT(elsewhere->errors(), HasSubstr("no participant could join"));
  EXPECT_THAT(elsewhere->errors(), HasSubstr("nowhere"));
}

TEST_F(Load, ReportsThatNoServerAnswers) {
  for (const std::vector<std::string>& endpoint :
       {std::vector<std::string>{"127.0.0.1:9"}, {"--web", "127.0.0.1:9"}}) {
    const auto program = load(endpoint);
    EXPECT_EQ(program->waitForEnd(kEnd), 3);
    EXPECT_THAT(program->errors(), HasSubstr("no participant could join at 127.0.0.1:9"));
  }
}

TEST_F(Load, RefusesInvalidArguments) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--viewers", "11"},
                                                    {"--decoders", "11"},
                                                    {"--participants", "0"},
                                                    {"--seconds", "0"},
                                                    {"--server-pid", "4000000000"},
                                                    {"--scenes", "0"},
                                                    {"--scenes", "2", "--scene", "small"},
                                                    {"--nodes", "64"},
                                                    {"--nodes", "3", "--scenes", "1"},
                                                    {"--rate", "9", "--scenes", "1"},
                                                    {"--participants", "2", "--scenes", "3"},
                                                    {"--pair", "123456", "--web"},
                                                    {"--web", "host:port"}}) {
    const auto program = load(arguments);
    EXPECT_EQ(program->waitForEnd(kEnd), 2) << arguments[0];
    EXPECT_THAT(program->errors(), HasSubstr(arguments[0] == "--web" ? "ADDRESS" : arguments[0]));
  }
}

TEST_F(Load, PrintsReportAfterInterrupt) {
  startServer();
  if (address_.empty()) return;
  const auto program = load({address_, "--participants", "2", "--seconds", "3600"});
  const auto watcher =
      std::make_unique<Process>(std::vector<std::string>{CLOTHSTREAM, "join", address_, "--seconds", "2"});
  EXPECT_EQ(watcher->waitForEnd(kEnd), 0);
  program->signal(SIGINT);
  EXPECT_EQ(program->waitForEnd(kEnd), 0);
  EXPECT_THAT(program->output(), HasSubstr("2 participants for"));
  EXPECT_THAT(program->output(), HasSubstr("from a pose to its effect first displayable"));
}

}  // namespace
}  // namespace clothstream::e2e
