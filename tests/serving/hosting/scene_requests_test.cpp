// SPDX-License-Identifier: MIT
// Requests about scenes that wait, fail or are cancelled.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/hosting/scene_maker.h"
#include "server/scene/journal.h"
#include "server/scene/scene_store.h"
#include "tests/serving/hosting/scenes_test.h"

namespace clothstream::hosting {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using tests::TestPeer;

TEST_F(ScenesTest, RefusesCreateSceneAtOnceWhileTooManyScenesWait) {
  START();
  // The maker's thread may use both after the end of the test.
  const auto began = std::make_shared<std::promise<void>>();
  std::promise<void> mayEnd;
  v1::CreateSceneRequest unknown;
  unknown.set_named("no such scene");
  server().unaryCalls.createScene(unknown, [began, end = mayEnd.get_future().share()](const auto&) {
    began->set_value();
    end.wait();  // the maker's thread stays busy, so all others wait
  });
  began->get_future().wait();
  for (std::uint32_t i = 0; i < SceneMaker::kMaxWaiting; ++i)
    server().unaryCalls.createScene(unknown, [](const auto&) {});
  TestPeer peer(server());
  const v1::ServerMessage answer = createNamed(peer, "folds", "late");
  EXPECT_EQ(answer.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(answer.error().text(), HasSubstr("64 scenes wait to be created; try again later"));
  mayEnd.set_value();
}

TEST_F(ScenesTest, RefusesOtherRequestsWhileTooManyWait) {
  START();
  const auto began = std::make_shared<std::promise<void>>();
  std::promise<void> mayEnd;
  v1::CreateSceneRequest unknown;
  unknown.set_named("no such scene");
  server().unaryCalls.createScene(unknown, [began, end = mayEnd.get_future().share()](const auto&) {
    began->set_value();
    end.wait();  // the maker's thread stays busy, so all others wait
  });
  began->get_future().wait();
  v1::DeleteSceneRequest request;
  request.set_name("small");
  for (std::uint32_t i = 0; i < SceneMaker::kMaxWaiting; ++i)
    server().unaryCalls.deleteScene(request, [](const auto&) {});
  TestPeer peer(server());
  EXPECT_THAT(deleteScene(peer, "small").error().text(),
              StartsWith("deleteScene: 64 requests about scenes wait; try again later"));
  v1::ClientMessage message;
  message.mutable_start_recording()->set_scene("small");
  EXPECT_THAT(ask(peer, message).error().text(), StartsWith("startRecording: 64 requests about scenes wait"));
  message.mutable_stop_recording()->set_scene("small");
  EXPECT_THAT(ask(peer, message).error().text(), StartsWith("stopRecording: 64 requests about scenes wait"));
  const auto counter = static_cast<std::size_t>(telemetry::Refusal::waitingScenes);
  EXPECT_EQ(server().metrics.refusals[counter].value(), 3u);
  mayEnd.set_value();
}

// Notes which scenes are kept and forgotten.
class NotingStore final : public scene::SceneStore {
 public:
  std::optional<scene::SavedScene> take(const model::Scene&) override { return {}; }
  std::vector<scene::SavedScene> takeCreated() override { return {}; }
  std::shared_ptr<scene::SceneKeeper> keep(const std::shared_ptr<scene::LiveScene>& scene) override {
    if (scene->terms.created) isKept = true;
    return nullptr;
  }
  void remove(const std::string& name) override { removed = name; }
  bool flush(std::chrono::milliseconds, const std::string&) override { return true; }
  scene::StoreStatus status() const override { return {}; }

  std::atomic<bool> isKept = false;
  std::string removed;
};

TEST_F(ScenesTest, ACancelledCreationIsNotKeptAndTheErrorSaysWhy) {
  const auto store = std::make_shared<NotingStore>();
  ServerOptions options;
  options.store = store;
  START(options);
  v1::CreateSceneRequest request;
  request.set_named("small");
  request.set_name("mine");
  const auto error = [&] {
    std::promise<std::string> done;
    // The peer leaves while the device loads the scene.
    server().unaryCalls.createScene(
        request, [&](const auto& made) { done.set_value(made ? "" : made.error().text()); },
        identity::local(), [&] { return !store->isKept; });
    return done.get_future().get();
  };
  EXPECT_THAT(error(), HasSubstr("the peer that asked for it has left"));
  EXPECT_EQ(store->removed, "mine");
  server().stop();
  EXPECT_THAT(error(), HasSubstr("the server stops"));
}

// A journal whose functions throw.
class TroubledJournal : public scene::Journal {
 public:
  messages::Result<std::string> start(const std::string&) override { throw std::runtime_error("no start"); }
  messages::Result<v1::StopRecordingResponse> stop() override { throw std::runtime_error("no stop"); }
  bool active() const override { return false; }
  bool due() const override { return false; }
  void begin(const vulkan::DeviceInfo&, const model::Scene&, const v1::StreamDescription&,
             const simulation::StateSnapshot&, const simulation::StateSnapshot&) override {}
  void ticked(const scene::AppliedTick&) override {}
  void saved(const simulation::StateSnapshot&) override {}
  void restored(std::uint64_t, const simulation::StateSnapshot&) override {}
  void end() override {}
  void sent(const delivery::SharedBytes&) override {}
  void joined(std::uint64_t, const std::string&, const std::string&) override {}
  void left(std::uint64_t) override {}
};

TEST_F(ScenesTest, RecordingExceptionsBecomeErrors) {
  ServerOptions options;
  options.journals = [](const model::Scene&) { return std::make_shared<TroubledJournal>(); };
  START(std::move(options));
  TestPeer peer(server());
  peer.join();
  v1::ClientMessage message;
  message.mutable_start_recording()->set_scene("small");
  EXPECT_EQ(ask(peer, message).error().text(), "startRecording: failed on the server: no start");
  message.mutable_stop_recording()->set_scene("small");
  EXPECT_EQ(ask(peer, message).error().text(), "stopRecording: failed on the server: no stop");
  ASSERT_TRUE(createNamed(peer, "small", "mine").has_create_scene());
  EXPECT_TRUE(deleteScene(peer, "mine").has_delete_scene());
}

// Blocks the device's thread between two ticks, from block() to release().
class BlockingJournal : public TroubledJournal {
 public:
  bool due() const override {
    std::unique_lock lock(mutex_);
    waits_ = blocks_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !blocks_; });
    waits_ = false;
    return false;
  }
  // Returns when the thread waits.
  void block() {
    std::unique_lock lock(mutex_);
    blocks_ = true;
    changed_.wait(lock, [this] { return waits_; });
  }
  void release() {
    const std::lock_guard lock(mutex_);
    blocks_ = false;
    changed_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable bool waits_ = false;
  bool blocks_ = false;
};

TEST_F(ScenesTest, CancelsASceneThatTheDeviceDoesNotLoad) {
  ServerOptions options;
  const auto journal = std::make_shared<BlockingJournal>();
  options.journals = [journal](const model::Scene& scene) -> std::shared_ptr<scene::Journal> {
    return scene.name == "small" ? journal : nullptr;
  };
  START(std::move(options));
  TestPeer peer(server());
  peer.join();
  journal->block();
  // Only a wait that checks for cancellation asks this often.
  constexpr int kChecks = 30;
  std::atomic<int> checks = 0;
  std::promise<std::string> answered;
  std::future<std::string> answer = answered.get_future();
  v1::CreateSceneRequest request;
  request.set_named("small");
  request.set_name("stuck");
  server().unaryCalls.createScene(
      request, [&](const auto& created) { answered.set_value(created ? "" : created.error().text()); },
      identity::local(), [&] { return ++checks < kChecks; });
  const bool inTime = answer.wait_for(TestPeer::kPatience) == std::future_status::ready;
  // Requests after it are answered as well while the device is stuck.
  v1::StopRecordingRequest stopping;
  stopping.set_scene("nowhere");
  std::promise<void> stopped;
  server().unaryCalls.stopRecording(stopping, [&](const auto&) { stopped.set_value(); });
  if (inTime) stopped.get_future().wait();
  journal->release();
  ASSERT_TRUE(inTime);
  EXPECT_THAT(answer.get(),
              StartsWith("createScene: cancelled, because the peer that asked for it has left"));
  peer.readFrames(3);
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 2);
  EXPECT_TRUE(createNamed(peer, "small", "stuck").has_create_scene()) << "the name is free again";
}

}  // namespace
}  // namespace clothstream::hosting
