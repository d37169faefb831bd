// SPDX-License-Identifier: MIT
// Frames that an edge keeps for viewers that join, and messages that it refuses.
#include "server/fleet/edge_source.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/fleet.pb.h"
#include "proto/codec/packet_header.h"
#include "server/fleet/message_bytes.h"
#include "server/scene/live_scene.h"

namespace clothstream::fleet {
namespace {

using schedule::Clock;

v1::StreamDescription description() {
  v1::StreamDescription description;
  description.set_epoch(1);
  description.set_codec(codec::kCodecHierarchical);
  description.set_simulation_rate(40);
  description.set_stream_rate(40);
  description.set_qualities(2);
  return description;
}

class EdgeSourceTest : public ::testing::Test {
 protected:
  EdgeSourceTest()
      : source_(std::make_shared<EdgeSource>(v1::OfferedScene{}, description(), [] {})),
        scene_("small", source_) {
    source_->begin(scene_);
  }

  // A frame with only a header. `reference` 0: a key frame.
  static delivery::SharedBytes frame(std::uint64_t tick, std::uint64_t reference = 0,
                                     std::uint8_t quality = 0, std::uint32_t epoch = 1) {
    codec::PacketHeader header;
    header.epoch = epoch;
    header.tick = tick;
    header.quality = quality;
    header.rangeCount = 1;
    header.ranges[0] = {0, 1};
    header.sectionCount = 1;  // empty
    if (reference != 0) {
      header.kind = codec::PacketKind::predicted;
      header.referenceCount = 1;
      header.references[0] = reference;
    }
    std::vector<std::byte> packet(codec::headerBound(header));
    packet.resize(codec::writeHeader(header, packet));
    return delivery::serialiseFrame({}, packet);
  }

  std::shared_ptr<delivery::Mailbox> join() {
    auto mailbox = std::make_shared<delivery::Mailbox>([] {});
    mailbox->subscribe(nullptr, scene_.shape(), scene_.metrics);
    scene_.subscribers.add(mailbox);
    EXPECT_EQ(mailbox->next(Clock::now()), std::nullopt);  // it waits
    return mailbox;
  }

  // Ticks of the frames that the viewer gets.
  static std::vector<std::uint64_t> ticksIn(delivery::Mailbox& mailbox) {
    std::vector<std::uint64_t> ticks;
    while (const auto message = mailbox.next(Clock::now())) {
      v1::ServerMessage read;
      EXPECT_TRUE(parse(**message, read));
      if (!read.has_frame()) continue;
      ticks.push_back(codec::parsePacket(std::as_bytes(std::span(read.frame().packet())))->header.tick);
      EXPECT_TRUE(mailbox.acknowledge(ticks.back(), Clock::now()));
    }
    return ticks;
  }

  std::shared_ptr<EdgeSource> source_;
  scene::LiveScene scene_;
};

TEST_F(EdgeSourceTest, AViewerGetsTheKeyFrameAndTheFramesSince) {
  for (const auto& message : {frame(10), frame(11, 10), frame(12, 11)})
    EXPECT_TRUE(source_->receiveFrame(*message));
  const auto viewer = join();
  EXPECT_EQ(source_->needs(Clock::now()).keyFrames, 0);
  EXPECT_EQ(ticksIn(*viewer), (std::vector<std::uint64_t>{10, 11, 12}));
  EXPECT_TRUE(source_->receiveFrame(*frame(13, 12)));
  EXPECT_EQ(ticksIn(*viewer), (std::vector<std::uint64_t>{13}));
}

TEST_F(EdgeSourceTest, AViewerThatHasFramesGetsThemOnce) {
  const auto first = join();
  EXPECT_TRUE(source_->receiveFrame(*frame(10)));
  EXPECT_TRUE(source_->receiveFrame(*frame(11, 10)));
  EXPECT_EQ(ticksIn(*first), (std::vector<std::uint64_t>{10, 11}));
  const auto second = join();
  source_->needs(Clock::now());
  EXPECT_EQ(ticksIn(*first), std::vector<std::uint64_t>{});
  EXPECT_EQ(ticksIn(*second), (std::vector<std::uint64_t>{10, 11}));
}

TEST_F(EdgeSourceTest, ALongerRunOrAGapIsNotKept) {
  for (const auto& message : {frame(10), frame(11, 10), frame(12, 11), frame(13, 12)})
    EXPECT_TRUE(source_->receiveFrame(*message));
  const auto viewer = join();
  EXPECT_EQ(source_->needs(Clock::now()).keyFrames, 1);
  EXPECT_EQ(ticksIn(*viewer), std::vector<std::uint64_t>{});
  // 21 is lost, and 22 refers to it.
  EXPECT_TRUE(source_->receiveFrame(*frame(20)));
  EXPECT_TRUE(source_->receiveFrame(*frame(22, 21)));
  EXPECT_EQ(ticksIn(*viewer), (std::vector<std::uint64_t>{20}));
  const auto later = join();
  EXPECT_EQ(source_->needs(Clock::now()).keyFrames, 1);
  EXPECT_EQ(ticksIn(*later), std::vector<std::uint64_t>{});
}

TEST_F(EdgeSourceTest, QualitiesAreKeptSeparately) {
  EXPECT_TRUE(source_->receiveFrame(*frame(10, 0, 1)));
  const auto viewer = join();
  EXPECT_EQ(source_->needs(Clock::now()).keyFrames, 1);  // of quality 0
  EXPECT_EQ(ticksIn(*viewer), std::vector<std::uint64_t>{});
}

TEST_F(EdgeSourceTest, NothingIsKeptAcrossAnInterruption) {
  EXPECT_TRUE(source_->receiveFrame(*frame(10)));
  source_->forgetFrames();
  const auto viewer = join();
  EXPECT_EQ(source_->needs(Clock::now()).keyFrames, 1);
  EXPECT_EQ(ticksIn(*viewer), std::vector<std::uint64_t>{});
}

TEST_F(EdgeSourceTest, RefusesWhatDoesNotBelongToTheStream) {
  EXPECT_FALSE(source_->receiveFrame(*frame(10, 0, 0, 2)));  // another epoch
  EXPECT_FALSE(source_->receiveFrame(*frame(10, 0, 2)));     // a quality that the stream does not have
  EXPECT_TRUE(source_->receiveFrame(*frame(10)));
  EXPECT_FALSE(source_->receiveFrame(*frame(9)));  // older than the newest
  v1::ServerMessage welcome;
  welcome.mutable_welcome();
  EXPECT_FALSE(source_->receiveEvent(*toBytes(welcome)));
  EXPECT_FALSE(source_->receiveFrame(*toBytes(welcome)));
}

}  // namespace
}  // namespace clothstream::fleet
