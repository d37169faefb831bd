// SPDX-License-Identifier: MIT
// clothstream-server on a device that fails: a Vulkan layer simulates the loss.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "clients/grpc/scene_control.h"
#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recording_reader.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

class LostDevice : public RunningServer {
 protected:
  void startServer(const Arguments& more = kSmallScene) {
    setenv("VK_ADD_LAYER_PATH", CLOTHSTREAM_LAYERS, 1);
    setenv("VK_INSTANCE_LAYERS", "VK_LAYER_CLOTHSTREAM_lost_device", 1);
    setenv("CLOTHSTREAM_LOSE_DEVICE", file().c_str(), 1);
    RunningServer::startServer(more);
    for (const char* name : {"VK_ADD_LAYER_PATH", "VK_INSTANCE_LAYERS", "CLOTHSTREAM_LOSE_DEVICE"})
      unsetenv(name);
  }
  // Makes the next submission fail; lost_device/layer.cpp defines the words. The rename makes the file
  // complete when it appears.
  void fail(const std::string& word) {
    std::ofstream(file().string() + ".draft") << word;
    std::filesystem::rename(file().string() + ".draft", file());
  }

  bool hasFailed() const {
    return eventually([&] { return !std::filesystem::exists(file()); });
  }

  TemporaryDirectory directory_;

 private:
  std::filesystem::path file() const { return directory_.path() / "lose"; }
};

// Most ticks between the last frame before a failure and the first one after it: 0.1 s of the scene.
constexpr std::uint64_t kMaxTicksSkipped = 12;

// A client of a scene. Counts cuts, restarts, skipped ticks and frames that do not match.
struct Watcher {
  std::unique_ptr<NativeClient> join(const std::string& address, const std::string& scene = "") {
    NativeClientOptions options;
    options.scene = scene;
    auto joined = joinByGrpc(address, options, [this](cs_client* client, std::uint32_t events) {
      if (events == 0) ++cuts;
      // Ignores other notices: a busy machine cannot keep the rate.
      if ((events & CS_EVENT_NOTICE) != 0 &&
          std::string(cs_notice_text(client)).find("the scene goes on from") != std::string::npos) {
        isRestarting = true;
        ++restarts;
      }
      if ((events & CS_EVENT_FRAME) == 0) return;
      cs_statistics now;
      cs_get_statistics(client, NativeClient::nowUs(), &now);
      if (now.tick <= tick) ++stepsBack;
      // Only a key frame can follow the failure, since the encoder has lost its references.
      if (now.key_frames > keyFrames && isRestarting.exchange(false)) {
        ticksSkipped = std::max<std::uint64_t>(ticksSkipped, now.tick - tick);
        ++keyFramesAfterRestart;
      }
      keyFrames = now.key_frames;
      tick = now.tick;
      mismatches = now.hash_mismatches;
      frames = now.frames;
    });
    EXPECT_TRUE(joined.has_value()) << joined.error().text;
    return joined ? std::move(*joined) : nullptr;
  }
  bool seesMore(std::uint64_t count) const {
    return eventually([&, from = frames.load()] { return frames >= from + count; });
  }
  // Whether the first frame after the newest restart has arrived.
  bool hasContinued() const {
    return eventually([&] { return keyFramesAfterRestart >= restarts; });
  }
  void expectNothingWrong() const {
    EXPECT_EQ(mismatches, 0u);
    EXPECT_LE(ticksSkipped, kMaxTicksSkipped);
    EXPECT_EQ(stepsBack, 0);
    EXPECT_EQ(cuts, 0);
  }

  std::atomic<std::uint64_t> tick{0}, frames{0}, keyFrames{0}, mismatches{0}, ticksSkipped{0};
  std::atomic<int> cuts{0}, restarts{0}, stepsBack{0}, keyFramesAfterRestart{0};
  std::atomic<bool> isRestarting{false};
};

float gravityOf(NativeClient& client) {
  cs_environment environment{};
  client.visit([&](cs_client* core) { cs_get_environment(core, &environment); });
  return environment.gravity[1];
}

// Initial gravity (m/s^2) and number of ticks in a recording.
struct Simulated {
  double gravity = 0;
  std::size_t ticks = 0;
};
Simulated simulatedIn(const std::filesystem::path& path) {
  Simulated simulated;
  auto reader = recording::RecordingReader::open(path.string());
  EXPECT_TRUE(reader) << reader.error();
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    simulated.ticks += (*message)->topic == recording::Topic::ticks ? 1 : 0;
    if ((*message)->topic != recording::Topic::scene) continue;
    v1::RecordedScene recorded;
    EXPECT_TRUE(recorded.ParseFromString(std::string((*message)->bytes)));
    simulated.gravity = recorded.scene().environment().gravity().y();
  }
  return simulated;
}

double milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

TEST_F(LostDevice, StreamContinuesAfterLossOfDevice) {
  startServer();
  if (address_.empty()) return;
  Watcher watcher;
  auto client = watcher.join(address_);
  ASSERT_TRUE(watcher.seesMore(90));
  fail("device");
  const auto lost = Clock::now();
  ASSERT_TRUE(eventually([&] { return watcher.restarts >= 1; }));
  ASSERT_TRUE(watcher.hasContinued());
  std::printf("device lost: the stream continues after %.0f ms, %lu ticks later\n",
              milliseconds(Clock::now() - lost), watcher.ticksSkipped.load());
  EXPECT_EQ(watcher.keyFramesAfterRestart, 1);
  watcher.expectNothingWrong();
  client.reset();
  stopServer();
  EXPECT_THAT(server_->errors() + server_->output(), HasSubstr("VK_ERROR_DEVICE_LOST"));
  EXPECT_THAT(server_->output(), ::testing::ContainsRegex("device rebuilds 1"));
}

TEST_F(LostDevice, SceneThatKeepsLosingTheDeviceIsStopped) {
  Arguments scenes = kSmallScene;
  scenes.insert(scenes.end(), {"--scene-file", "tests/e2e/small_with_normals.json"});
  startServer(scenes);
  if (address_.empty()) return;
  Watcher watcher;
  auto client = watcher.join(address_, "small");
  ASSERT_TRUE(watcher.seesMore(30));
  fail("device");
  ASSERT_TRUE(eventually([&] { return watcher.restarts >= 1; }));
  ASSERT_TRUE(watcher.hasContinued());
  fail("device");
  ASSERT_TRUE(eventually([&] { return client->ended().has_value(); }));
  EXPECT_THAT(client->ended()->text, HasSubstr("join again to start it with its own parameters"));
  Watcher later;
  auto third = later.join(address_, "small");
  ASSERT_TRUE(later.seesMore(30));
  fail("device");
  ASSERT_TRUE(eventually([&] { return third->ended().has_value(); }));
  const std::string why = "the scene 'small' is stopped because it harms other scenes";
  EXPECT_THAT(third->ended()->text, HasSubstr(why));
  const auto again = joinByGrpc(address_, {}, [](cs_client*, std::uint32_t) {});
  ASSERT_FALSE(again.has_value());
  EXPECT_THAT(again.error().text, HasSubstr(why));
  Watcher other;
  auto second = other.join(address_, "small_with_normals");
  ASSERT_TRUE(other.seesMore(30));
  other.expectNothingWrong();
  second.reset();
  stopServer();
  EXPECT_THAT(server_->output(), HasSubstr("scenes in quarantine 1"));
}

TEST_F(LostDevice, ServerEndsAlthoughTheDeviceHangs) {
  for (const bool again : {false, true}) {
    Arguments arguments = kSmallScene;
    arguments.insert(arguments.end(), {"--drain", again ? "600" : "1"});
    startServer(arguments);
    if (address_.empty()) return;
    Watcher watcher;
    auto client = watcher.join(address_);
    ASSERT_TRUE(watcher.seesMore(10));
    fail("hang");
    ASSERT_TRUE(hasFailed());
    server_->signal(SIGTERM);
    if (again) {
      ASSERT_TRUE(eventually([&] { return watcher.cuts >= 1; })) << "the server has begun to end";
      server_->signal(SIGTERM);
    }
    EXPECT_EQ(server_->waitForEnd(kPatience), 1);
    EXPECT_THAT(server_->errors(),
                HasSubstr(again ? "ending at once: another signal came"
                                : "ending at once: the device or the disk does not answer"));
    server_.reset();
  }
}

TEST_F(LostDevice, FailedTickAffectsItsSceneOnly) {
  Arguments scenes = kSmallScene;
  scenes.insert(scenes.end(), {"--scene-file", "tests/e2e/small_with_normals.json"});
  startServer(scenes);
  if (address_.empty()) return;
  Watcher one, other;
  auto first = one.join(address_, "small"), second = other.join(address_, "small_with_normals");
  const auto restarts = [&] { return one.restarts + other.restarts; };
  for (int failure = 1; failure <= 2; ++failure) {
    // More than a second apart, since a scene that fails again at once is given up.
    ASSERT_TRUE(one.seesMore(90));
    ASSERT_TRUE(other.seesMore(90));
    fail("memory");
    const auto failed = Clock::now();
    ASSERT_TRUE(eventually([&] { return restarts() >= failure; }));
    ASSERT_TRUE(one.hasContinued());
    ASSERT_TRUE(other.hasContinued());
    ASSERT_TRUE(one.seesMore(1));
    ASSERT_TRUE(other.seesMore(1));
    std::printf("a tick failed: the stream continues after %.0f ms, %lu ticks later\n",
                milliseconds(Clock::now() - failed),
                std::max(one.ticksSkipped.load(), other.ticksSkipped.load()));
  }
  // Each failure is announced in one of the two scenes; the other continues.
  ASSERT_TRUE(one.seesMore(30));
  ASSERT_TRUE(other.seesMore(30));
  EXPECT_EQ(restarts(), 2);
  one.expectNothingWrong();
  other.expectNothingWrong();
  first.reset();
  second.reset();
  stopServer();
  EXPECT_THAT(server_->errors() + server_->output(), HasSubstr("a tick failed: "));
  EXPECT_THAT(server_->output(), HasSubstr("device rebuilds 0"));
}

TEST_F(LostDevice, SceneThatFailsTwiceIsGivenUpAndStartsFromTheBeginning) {
  const std::filesystem::path recordings = directory_.path() / "recordings";
  Arguments arguments = kSmallScene;
  arguments.insert(arguments.end(), {"--recordings", recordings.string()});
  startServer(arguments);
  if (address_.empty()) return;
  Watcher watcher;
  auto client = watcher.join(address_);
  const float gravity = gravityOf(*client);
  client->visit([](cs_client* core) {
    const float less[]{0, -3, 0};
    cs_set_environment(core, less, nullptr, nullptr);
  });
  ASSERT_TRUE(eventually([&] { return gravityOf(*client) == -3; }));
  ASSERT_TRUE(startRecording(address_, "small", "before"));
  ASSERT_TRUE(watcher.seesMore(60));
  fail("memory");
  ASSERT_TRUE(hasFailed());
  // Paused, so that no tick comes before the next failure.
  ASSERT_TRUE(controlScene(address_, "small", true, false));
  ASSERT_TRUE(eventually([&] { return watcher.restarts >= 1; }));
  // Input that waits for the next tick must not reach the new scene.
  client->visit([](cs_client* core) {
    const cs_own_collider sphere{.shape = CS_SHAPE_SPHERE,
                                 .position = {0, 1, 0},
                                 .orientation = {},
                                 .radius = 0.1f,
                                 .length = 0,
                                 .size = {},
                                 .top_radius = 0};
    cs_set_colliders(core, &sphere, 1, NativeClient::nowUs());
  });
  fail("memory");
  ASSERT_TRUE(controlScene(address_, "small", false, false));
  ASSERT_TRUE(eventually([&] { return client->ended().has_value(); }));
  EXPECT_THAT(client->ended()->text, HasSubstr("the device cannot run the scene 'small'"));
  EXPECT_EQ(watcher.mismatches, 0u);
  EXPECT_EQ(watcher.restarts, 1);

  Watcher later;
  auto another = later.join(address_);
  EXPECT_EQ(gravityOf(*another), gravity);
  ASSERT_TRUE(later.seesMore(1));
  const auto file = startRecording(address_, "small", "after");
  ASSERT_TRUE(file) << file.error().text;
  ASSERT_TRUE(later.seesMore(60));
  another->visit([&](cs_client* core) {
    for (std::uint32_t i = 0; i < cs_collider_count(core); ++i) {
      cs_collider collider;
      EXPECT_EQ(cs_get_collider(core, i, &collider), 1);
      EXPECT_EQ(collider.participant_id, 0u);
    }
  });
  const auto stopped = stopRecording(address_, "small");
  ASSERT_TRUE(stopped) << stopped.error().text;
  later.expectNothingWrong();
  EXPECT_EQ(gravityOf(*another), gravity);
  another.reset();
  stopServer();
  EXPECT_FLOAT_EQ(static_cast<float>(simulatedIn(recordings / "before.mcap").gravity), -3);
  EXPECT_FLOAT_EQ(static_cast<float>(simulatedIn(recordings / "after.mcap").gravity), gravity);
  EXPECT_GE(simulatedIn(recordings / "after.mcap").ticks, 60u);
  for (const char* name : {"before.mcap", "after.mcap"}) {
    Process again({CLOTHSTREAM_SERVER, "resimulate", (recordings / name).string()});
    EXPECT_EQ(again.waitForEnd(kPatience), 0) << again.output() << again.errors();
  }
}

TEST_F(LostDevice, RebuildThatFailsIsTriedOnceMore) {
  startServer();
  if (address_.empty()) return;
  Watcher watcher;
  auto client = watcher.join(address_);
  ASSERT_TRUE(watcher.seesMore(90));
  fail("memory 2");  // the tick, and the first submission of the rebuild
  ASSERT_TRUE(eventually([&] { return watcher.restarts >= 1; }));
  ASSERT_TRUE(watcher.seesMore(90));
  watcher.expectNothingWrong();
  fail("memory 3");
  ASSERT_TRUE(eventually([&] { return client->ended().has_value(); }));
  EXPECT_THAT(client->ended()->text, HasSubstr("the device cannot run the scene 'small'"));
  EXPECT_EQ(watcher.restarts, 1);
  Watcher later;
  auto another = later.join(address_);
  ASSERT_TRUE(later.seesMore(30));
  later.expectNothingWrong();
}

}  // namespace
}  // namespace clothstream::e2e
