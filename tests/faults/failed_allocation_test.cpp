// SPDX-License-Identifier: MIT
// An allocation that fails leaves messages and transactions in order.
#include <algorithm>
#include <chrono>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/saved_state/database.h"
#include "server/scene/live_scene.h"
#include "server/scene/pose_history.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/faults/lack_of_memory.h"
#include "tests/serving/scene/hosted_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

class FailedAllocation : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer replaces operator new itself";
#endif
  }
};

// The first allocation of `work` fails.
template <class Work>
void expectBadAlloc(const Work& work) {
  const ThreadName name("failing");
  const LackOfMemory lack("failing", {});
  EXPECT_THROW(work(), std::bad_alloc);
}

TEST_F(FailedAllocation, LeavesOneofOfMessageEmpty) {
  v1::ServerMessage message;
  expectBadAlloc([&] { message.mutable_error(); });
  EXPECT_EQ(message.body_case(), v1::ServerMessage::BODY_NOT_SET);
  message.mutable_frame();
  expectBadAlloc([&] { message.mutable_error(); });
  EXPECT_EQ(message.body_case(), v1::ServerMessage::BODY_NOT_SET);
  message.mutable_error();
  message.Clear();
  expectBadAlloc([&] { message.mutable_error(); });
  EXPECT_EQ(message.body_case(), v1::ServerMessage::BODY_NOT_SET);
}

TEST_F(FailedAllocation, LeavesOptionalMemberOfMessageAbsent) {
  v1::ParameterChange change;
  expectBadAlloc([&] { change.mutable_gravity(); });
  EXPECT_FALSE(change.has_gravity());
  EXPECT_EQ(change.ByteSizeLong(), 0u);
}

TEST_F(FailedAllocation, AddsNoTextToMessage) {
  const std::uint64_t allocations = failEachAllocation(
      1, [] { return v1::StreamDescription(); },
      [](v1::StreamDescription& description) { description.add_materials(std::string(100, 'a')); },
      [](const v1::StreamDescription& description) {
        // A counted text that does not exist would be one that was cleared.
        EXPECT_EQ(description.materials().ClearedCount(), 0);
        for (const std::string& material : description.materials())
          EXPECT_EQ(material, std::string(100, 'a'));
      });
  EXPECT_GE(allocations, 3u);
}

// The last body counts. The parser creates both.
TEST_F(FailedAllocation, EndsParsingOfMessageWithTwoBodies) {
  v1::ClientMessage first, second;
  first.mutable_start_recording()->set_scene(std::string(100, 'a'));
  second.mutable_get_scene()->set_name(std::string(100, 'b'));
  const std::string bytes = first.SerializeAsString() + second.SerializeAsString();
  const std::uint64_t allocations = failEachAllocation(
      1, [] { return v1::ClientMessage(); },
      [&](v1::ClientMessage& message) { EXPECT_TRUE(message.ParseFromString(bytes)); },
      [&](const v1::ClientMessage& message) { EXPECT_LE(message.SerializeAsString().size(), bytes.size()); });
  EXPECT_GE(allocations, 4u);
}

TEST_F(FailedAllocation, EndsTransactionOfDatabase) {
  const e2e::TemporaryDirectory directory;
  saved_state::Database database({.directory = directory.path()});
  const saved_state::SceneContents contents{.scene = std::string(100, 'a'), .session = std::string(100, 'b')};
  const std::uint64_t allocations = failEachAllocation(
      1, [] { return 0; }, [&](int) { EXPECT_TRUE(database.write("starved", contents)); },
      [&](int) {
        const auto written = database.write("other", contents);
        EXPECT_TRUE(written) << written.error();
      });
  EXPECT_GE(allocations, 4u);
}

TEST_F(FailedAllocation, LeavesPosesUsable) {
  const auto add = [](scene::PoseHistory& history) {
    model::ParticipantPoses poses;
    poses.colliders.resize(2);
    history.add({.participant = 1, .now = {.poses = std::move(poses), .arrival = schedule::Clock::now()}});
  };
  const auto place = [](scene::PoseHistory& history) {
    history.place(schedule::Clock::now(), [](std::uint64_t, const model::ParticipantPoses& poses) {
      EXPECT_EQ(poses.colliders.size(), 2u);
    });
  };
  EXPECT_GE(failEachAllocation(
                1, [] { return scene::PoseHistory(); }, add, place),
            2u);
}

using FailedAllocationInTick = GpuTest;

// One allocation after another fails, until those that applying a change needs have failed.
TEST_F(FailedAllocationInTick, LosesNoChangeOfParameters) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer replaces operator new itself";
#endif
  constexpr std::uint64_t kAllocations = 40;
  for (std::uint64_t from = 0; from < kAllocations; ++from) {
    HostedScene hosted;
    hosted.tick();
    model::ParameterChange change;
    change.cloths.push_back({.numbers = {{parameters::ClothNumber::drag, 0.9f}}});
    hosted.change(change);
    hosted.announced.clear();
    bool failed = false;
    try {
      const ThreadName name("failing");
      const LackOfMemory lack("failing", {.from = from, .time = std::chrono::hours(1)});
      hosted.host.begin(hosted.now);
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    if (failed) {
      hosted.publisher.drain();
      device().drain();
      hosted.host.release();
      hosted.host.rebuild(
          std::make_unique<scene::SceneOnDevice>(device(), hosted.live.start(), hosted.publisher.workers()),
          "memory ran out");
    } else {
      hosted.finish();
    }
    hosted.tick();
    EXPECT_TRUE(std::ranges::any_of(hosted.announced, &v1::ServerMessage::has_parameter_changed)) << from;
    EXPECT_EQ(hosted.live.inbox.depth().changes, 0u) << from;
  }
}

}  // namespace
}  // namespace clothstream::tests
