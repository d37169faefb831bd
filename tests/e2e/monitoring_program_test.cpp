// SPDX-License-Identifier: MIT
// The real clothstream-server with a port for operators and a log of JSON lines.
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "server/messages/scene_file.h"
#include "tests/e2e/server_process.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/web_client.h"
#include "tests/serving/small_scene.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;

class MonitoringProgram : public ::testing::Test {
 protected:
  std::vector<std::string> options(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"--scene-file", sceneFile(),
                                 "--scene",      "small",
                                 "--port",       "0",
                                 "--grpc-port",  "0",
                                 "--cache-dir",  directory_.path() / "cache"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::filesystem::path sceneFile() const { return directory_.path() / "small.json"; }
  static std::string sceneText() { return messages::toJson(smallScene("small")); }

 private:
  e2e::TemporaryDirectory directory_;
};

// Port in the line "metrics http://127.0.0.1:9464/metrics".
std::uint16_t metricsPort(ServerProcess& server) {
  const std::string line = server.lineWith("metrics http://127.0.0.1:");
  return static_cast<std::uint16_t>(std::stoul(line.substr(line.rfind(':') + 1)));
}

// The server waits for its scene in a pipe, so that it is starting for as long as the test wants.
TEST_F(MonitoringProgram, IsReadyFromTheFirstSceneUntilItStops) {
  ASSERT_EQ(mkfifo(sceneFile().c_str(), 0600), 0);
  ServerProcess server(options({"--metrics-port", "0"}));
  const std::uint16_t port = metricsPort(server);
  const Response starting = HttpClient(port).get("/readyz");
  EXPECT_EQ(starting.result(), http::status::service_unavailable);
  EXPECT_THAT(starting.body(), HasSubstr("starting"));
  EXPECT_EQ(HttpClient(port).get("/healthz").result(), http::status::ok);
  std::ofstream(sceneFile()) << sceneText();

  WebSocketClient client(server.portIn(server.lineWith("page    http://")));
  client.send(hello());
  Viewer viewer;
  ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 3; }));
  EXPECT_EQ(HttpClient(port).get("/readyz").result(), http::status::ok);
  EXPECT_EQ(HttpClient(port).get("/healthz").result(), http::status::ok);
  const std::string metrics = HttpClient(port).get("/metrics").body();
  EXPECT_THAT(metrics, HasSubstr("clothstream_build_info{version=\"0."));
  EXPECT_THAT(metrics, HasSubstr("clothstream_scene_participants{scene=\"small\"} 1\n"));

  server.signal(SIGTERM);
  bool ready = true;  // until it answers that it is stopping, or has ended
  while (ready) try {
      ready = HttpClient(port).get("/readyz").result() == http::status::ok;
    } catch (const ClientError&) {
      ready = false;
    }
  client.watch(viewer, [] { return false; });
  EXPECT_EQ(server.exitCode(), 0) << server.output();
}

TEST_F(MonitoringProgram, HasNoPortForOperatorsByDefault) {
  std::ofstream(sceneFile()) << sceneText();
  ServerProcess server(options({"--seconds", "0.1"}));
  EXPECT_EQ(server.exitCode(), 0) << server.output();
  EXPECT_THAT(server.output(), testing::Not(HasSubstr("metrics http")));
}

TEST_F(MonitoringProgram, LogsJsonWithSceneAndParticipantAndWithoutTokens) {
  std::ofstream(sceneFile()) << sceneText();
  ServerProcess server(options({"--log-format", "json", "--log-level", "trace"}));
  const std::uint16_t port = server.portIn(server.lineWith("page    http://"));
  Viewer viewer;
  {
    WebSocketClient client(port);
    client.send(hello());
    ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 3; }));
    client.leave();
  }
  {
    WebSocketClient stranger(port);
    stranger.send(hello("no\n\x1b[2J scene"));
    Viewer refused;
    stranger.watch(refused, [] { return false; });
  }
  server.signal(SIGTERM);
  EXPECT_EQ(server.exitCode(), 0) << server.output();

  std::vector<nlohmann::json> objects;
  std::istringstream lines(server.output());
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('{')) continue;  // of standard output
    for (const char c : line) EXPECT_TRUE(c >= 0x20 && c < 0x7f) << line;
    objects.push_back(nlohmann::json::parse(line));
  }
  const auto logged = [&](const std::string& message) {
    return std::ranges::any_of(objects, [&](const nlohmann::json& object) {
      return object.value("scene", "") == "small" &&
             object.value("participant", std::uint64_t{0}) == viewer.welcome.participant_id() &&
             object["message"].get<std::string>().find(message) != std::string::npos;
    });
  };
  EXPECT_TRUE(logged("joined as participant")) << server.output();
  EXPECT_TRUE(logged("left")) << server.output();
  EXPECT_TRUE(std::ranges::any_of(objects, [](const nlohmann::json& object) {
    return object["message"] == "stopping" && object["level"] == "info" && !object.contains("scene");
  }));

  const std::string& token = viewer.welcome.resume_token();
  ASSERT_FALSE(token.empty());
  std::string hex;
  for (const char c : token) hex += fmt::format("{:02x}", static_cast<unsigned char>(c));
  std::string escaped;
  for (const char c : token) escaped += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  for (const std::string& form : {token, hex, escaped})
    EXPECT_EQ(server.output().find(form), std::string::npos) << "the log contains a resume token";
}

}  // namespace
}  // namespace clothstream::tests
