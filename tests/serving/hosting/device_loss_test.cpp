// SPDX-License-Identifier: MIT
// Loss of the device in a server with several scenes: each runs again as soon as it is loaded.
#include <algorithm>
#include <cstdint>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/server_test.h"

namespace clothstream::hosting {
namespace {

using tests::TestPeer;

using DeviceLossTest = tests::ServerTest;

// Start of the frame's tick, microseconds of the server's clock.
std::uint64_t timeOf(const tests::SeenFrame& frame) {
  v1::ServerMessage message;
  EXPECT_TRUE(message.ParseFromArray(frame.message->data(), static_cast<int>(frame.message->size())));
  return message.frame().tick_time_us();
}

// Reads until the scene was rebuilt and has sent a frame, and returns the time of that frame.
std::uint64_t readToTheNextStart(TestPeer& peer) {
  const v1::ServerMessage rebuilt = peer.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT;
  });
  EXPECT_THAT(rebuilt.notice().text(), testing::StartsWith("the device was lost; the scene goes on from"));
  peer.readFrames(1);
  return timeOf(peer.frames().back());
}

TEST_F(DeviceLossTest, RunsScenesAgainOneByOneDefaultFirst) {
  std::vector<model::Scene> more;
  for (int i = 0; i < 4; ++i) more.push_back(tests::smallScene(fmt::format("more-{}", i)));
  start({}, more);
  if (IsSkipped()) return;
  TestPeer first(server());
  first.join("small");
  std::vector<std::unique_ptr<TestPeer>> others;
  for (const char* scene : {"other", "more-0", "more-1", "more-2", "more-3", "more-3"}) {
    others.push_back(std::make_unique<TestPeer>(server()));
    others.back()->join(scene);
  }
  server().state().device.simulateDeviceLoss();
  // All read at the same time, because a peer that does not read loses frames.
  std::vector<std::future<std::uint64_t>> reading;
  for (const auto& peer : others)
    reading.push_back(std::async(std::launch::async, [&peer] { return readToTheNextStart(*peer); }));
  const std::uint64_t start = readToTheNextStart(first);
  const std::uint64_t startTick = first.frames().back().tick;
  std::vector<std::uint64_t> starts;
  for (std::future<std::uint64_t>& each : reading) starts.push_back(each.get());
  const std::uint64_t mostJoined = starts.back();
  starts.resize(4);  // of the scenes with one participant
  EXPECT_LT(start, mostJoined);
  EXPECT_LT(mostJoined, *std::ranges::min_element(starts));
  // The default scene has run while the last ones were being loaded.
  const std::uint64_t last = *std::ranges::max_element(starts);
  while (timeOf(first.frames().back()) < last) first.readFrames(1);
  EXPECT_GT(first.frames().back().tick, startTick + 1);
  EXPECT_EQ(server().state().metrics.deviceRebuilds.value(), 1u);
}

}  // namespace
}  // namespace clothstream::hosting
