// SPDX-License-Identifier: MIT
// A lack of memory on a thread of recordings, playback or saved states ends neither the server nor its
// streams.
#include "tests/faults/lack_of_memory.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/saved_state.pb.h"
#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/recording/playback.h"
#include "server/recording/recordings.h"
#include "server/saved_state/saved_state.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/transport.h"
#include "tests/recording/sample.h"
#include "tests/support/eventually.h"

namespace clothstream::tests {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// A viewer of the scene that joins again when it loses its stream, as real clients do.
class PersistentViewer {
 public:
  PersistentViewer(Transport& transport, std::string scene)
      : transport_(transport), scene_(std::move(scene)) {}

  // Returns when a frame has arrived. Tries for a minute.
  ::testing::AssertionResult seesFrame() {
    std::string last = "no frame";
    for (const auto end = Clock::now() + 1min; Clock::now() < end;) try {
        if (joined_ && joined_->see(1)) return ::testing::AssertionSuccess();
        joined_.reset();
        joined_ = std::make_unique<Joined>(transport_.connect(), scene_);
        if (joined_->viewer.frames > 0) return ::testing::AssertionSuccess();
        last = joined_->viewer.errors.empty() ? "the stream ended" : joined_->viewer.errors.back().text();
        joined_.reset();
      } catch (const std::runtime_error& failure) {
        last = failure.what();
        joined_.reset();
      }
    return ::testing::AssertionFailure() << last;
  }
  // Sends if there is a stream.
  void send(const v1::ClientMessage& message) {
    if (joined_ && !joined_->client->send(message.SerializeAsString())) joined_.reset();
  }

 private:
  Transport& transport_;
  const std::string scene_;
  std::unique_ptr<Joined> joined_;
};

// Every failure pattern of one thread: one failure at each of the first allocations, and three in a row, so
// that handling the first one fails too; some failures, only large allocations, and no memory at all.
std::vector<Failures> patterns() {
  std::vector<Failures> all;
  for (std::uint64_t from = 0; from < 8; ++from) all.push_back({.from = from});
  for (std::uint64_t from = 0; from < 8; from += 2) all.push_back({.from = from, .count = 3});
  constexpr std::uint64_t kUnlimited = 1'000'000'000;
  for (const std::uint64_t seed : {1u, 2u})
    for (const double probability : {0.02, 0.3})
      all.push_back({.count = kUnlimited, .probability = probability, .seed = seed});
  all.push_back({.count = kUnlimited, .leastBytes = 1024});
  all.push_back({.count = kUnlimited});
  return all;
}

// Lets allocations of the thread fail while `work` is repeated, and expects frames afterwards. Calls
// `prepare` before each pattern.
void starve(
    const std::string& thread, PersistentViewer& viewer, const std::function<void()>& work,
    const std::function<void()>& prepare = [] {}) {
  std::uint64_t failed = 0;
  for (const Failures& failures : patterns()) {
    ASSERT_NO_FATAL_FAILURE(prepare());
    const std::string trace =
        fmt::format("{}: from {}, count {}, probability {}, seed {}, at least {} bytes", thread,
                    failures.from, failures.count, failures.probability, failures.seed, failures.leastBytes);
    SCOPED_TRACE(trace);
    {
      const LackOfMemory lack(thread, failures);
      do {
        work();
      } while (!lack.isOver());
      failed += lack.failed();
    }
    ASSERT_TRUE(viewer.seesFrame());
  }
  std::printf("%s: %d allocations failed\n", thread.c_str(), static_cast<int>(failed));
}

class LackOfMemoryTest : public SmallServer {
 protected:
  static constexpr const char* kServer = "scenes";

  void SetUp() override {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer replaces operator new itself";
#endif
    const ThreadName name(kServer);
    SmallServer::SetUp();
    spdlog::set_level(spdlog::level::off);
    if (IsSkipped()) return;
    const ThreadName web("web");
    transport_->open(server());
  }
  void TearDown() override {
    transport_->close();
    SmallServer::TearDown();
  }
  hosting::ServerOptions options() override {
    {
      const ThreadName name("state");
      store_ = std::make_shared<saved_state::SavedState>(saved_state::SavedStateOptions{
          .directory = state_.path(), .checkpointInterval = 10ms, .lookInterval = 5ms});
    }
    hosting::ServerOptions options;
    options.store = store_;
    options.journals = [this](const model::Scene& scene) { return recordings_.add(scene.name); };
    return options;
  }

  // Requests of a busy client. Each may fail.
  void work() {
    ++round_;
    v1::ClientMessage change;
    v1::ParameterChange& parameters = *change.mutable_parameter_change();
    parameters.mutable_wind()->mutable_value()->set_x(static_cast<float>(round_ % 7));
    viewer_.send(change);
    for (v1::ClientMessage& message : requests()) viewer_.send(message);
    // A reader that waits for an answer would wait for long if memory ran out in between.
    static_cast<void>(viewer_.seesFrame());
  }
  std::vector<v1::ClientMessage> requests() const {
    std::vector<v1::ClientMessage> all(5);
    const std::string name = fmt::format("made_{}", round_ % 3);
    all[0].mutable_delete_scene()->set_name(name);
    v1::Scene& scene = *all[1].mutable_create_scene()->mutable_scene();
    scene.set_name(name);
    v1::Cloth& cloth = *scene.add_cloths();
    cloth.set_name("sheet");
    cloth.mutable_grid()->set_rows(8);
    cloth.mutable_grid()->set_columns(8);
    cloth.mutable_grid()->set_width(1);
    cloth.mutable_grid()->set_height(1);
    cloth.set_mass(0.1f);
    all[2].mutable_list_scenes();
    all[3].mutable_get_scene()->set_name("small");
    round_ % 2 == 0 ? all[4].mutable_start_recording()->set_scene("small")
                    : all[4].mutable_stop_recording()->set_scene("small");
    std::uint64_t id = 0;
    for (v1::ClientMessage& message : all) message.set_request_id(static_cast<std::uint32_t>(++id));
    return all;
  }

  const e2e::TemporaryDirectory state_, recorded_;
  recording::Recordings recordings_{{.directory = recorded_.path(), .serverName = "test"}, false};
  std::shared_ptr<saved_state::SavedState> store_;
  const std::unique_ptr<Transport> transport_ = makeWebTransport();
  PersistentViewer viewer_{*transport_, "small"};
  int round_ = 0;
};

// The first test, because others use descriptors.
TEST_F(LackOfMemoryTest, ServerBuildsDescriptorsWhenItStarts) {
  const auto use = [](int) {
    v1::RecordedTick::descriptor();
    v1::SavedScene::descriptor();
    v1::Scene::descriptor();
    v1::ServerMessage::descriptor();
  };
  EXPECT_EQ(failEachAllocation(
                1, [] { return 0; }, use, [](int) {}),
            0u);
}

TEST_F(LackOfMemoryTest, WebEndpointSurvives) {
  starve("web", viewer_, [this] { work(); });
}

// The device thread, the publisher, the scene maker and the scene loader.
TEST_F(LackOfMemoryTest, ThreadsOfScenesSurvive) {
  ASSERT_TRUE(viewer_.seesFrame());
  const std::vector<int> threads = threadsNamed(kServer);
  ASSERT_GE(threads.size(), 4u);
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const std::string name = fmt::format("{}-{}", kServer, i);
    renameThread(threads[i], name);
    starve(name, viewer_, [this] { work(); });
  }
}

TEST_F(LackOfMemoryTest, WriterOfSavedStateSurvives) {
  starve("state", viewer_, [this] { work(); });
  EXPECT_TRUE(store_->flush(1min));
}

TEST_F(LackOfMemoryTest, RecorderSurvives) {
  ASSERT_TRUE(viewer_.seesFrame());
  const std::vector<int> others = threadsNamed(kServer);
  // Sends the request again if it was one too many for its rate.
  const auto request = [&](const v1::ClientMessage& message, const std::function<bool()>& done) {
    return eventually([&] {
      viewer_.send(message);
      for (int frame = 0; frame < 10; ++frame)
        if (viewer_.seesFrame() && done()) return true;
      return false;
    });
  };
  // A failure ends a recording, so each pattern gets its own.
  const auto record = [&] {
    v1::ClientMessage start, stop;
    start.mutable_start_recording()->set_scene("small");
    stop.mutable_stop_recording()->set_scene("small");
    ASSERT_TRUE(request(stop, [] { return threadsNamed("recorder").empty(); }));
    ASSERT_TRUE(request(start, [&] { return threadsNamed(kServer).size() > others.size(); }));
    for (const int thread : threadsNamed(kServer))
      if (std::ranges::find(others, thread) == others.end()) renameThread(thread, "recorder");
  };
  starve(
      "recorder", viewer_, [this] { static_cast<void>(viewer_.seesFrame()); }, record);
}

TEST(LackOfMemory, PlaybackSurvives) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer replaces operator new itself";
#endif
  spdlog::set_level(spdlog::level::off);
  auto stream = recording::RecordedStream::of(
      recording::readerOf(recording::sampleRecording(recording::kSampleFrames)));
  ASSERT_TRUE(stream);
  std::unique_ptr<hosting::SceneServer> server;
  {
    const ThreadName name("playback");
    server = std::make_unique<hosting::SceneServer>(
        "sample",
        std::make_shared<recording::Playback>(std::move(*stream), recording::PlaybackOptions{.loop = true}),
        hosting::ServerOptions{});
  }
  const std::unique_ptr<Transport> transport = makeWebTransport();
  transport->open(*server);
  {
    PersistentViewer viewer(*transport, "sample");
    starve("playback", viewer, [&] { static_cast<void>(viewer.seesFrame()); });
  }
  transport->close();
}

}  // namespace
}  // namespace clothstream::tests
