// SPDX-License-Identifier: MIT
// Decoding of frames, acknowledgements, key-frame requests, hashes and statistics.
#include <cmath>
#include <cstddef>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr auto kFrame = static_cast<std::uint32_t>(CS_EVENT_FRAME);

struct Joined {
  explicit Joined(ScriptedStream stream = {}) : server(std::move(stream)) { client.join(server); }

  std::vector<std::uint64_t> acks() {
    std::vector<std::uint64_t> ticks;
    for (const v1::ClientMessage& message : client.outgoing()) {
      if (message.has_frame_ack()) ticks.push_back(message.frame_ack().tick());
    }
    return ticks;
  }

  std::size_t keyFrameRequests() {
    std::size_t count = 0;
    for (const v1::ClientMessage& message : client.outgoing()) count += message.has_key_frame_request();
    return count;
  }

  ScriptedServer server;
  ClientUnderTest client;
};

// 640 m is exact in the decoded floats, whose spacing is then 0.06 mm.
TEST(Frames, AreMovedByTheOriginOfTheStream) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  description.mutable_origin()->set_x(640);
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1 << 18, 1));
  ASSERT_EQ(client.receive(server.frame(1, codec::PacketKind::key)), kFrame);
  const float* decoded = cs_positions(client.get());
  for (std::size_t i = 0; i < server.positions().size(); ++i)
    ASSERT_NEAR(decoded[i], server.positions()[i] + (i % 3 == 0 ? 640 : 0),
                std::sqrt(3.0f) * 0.0005f + 4e-5f);
}

class DecodedFrames : public ::testing::TestWithParam<codec::NormalMode> {};

TEST_P(DecodedFrames, AreWithinMaxErrorAndAcknowledged) {
  Joined joined({.normals = GetParam(), .cloths = {{"a", 9, 7}, {"b", 4, 5}}});
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    ASSERT_EQ(joined.client.receive(joined.server.frame(tick), tick * 28 * kMs), kFrame);
    EXPECT_THAT(joined.acks(), ElementsAre(tick));
    const std::vector<float>& sent = joined.server.positions();
    const float* decoded = cs_positions(joined.client.get());
    // Maximum error of the codec, plus float rounding at about 2 m.
    for (std::size_t i = 0; i < sent.size(); i += 3) {
      const float off =
          std::hypot(decoded[i] - sent[i], decoded[i + 1] - sent[i + 1], decoded[i + 2] - sent[i + 2]);
      ASSERT_LE(off, std::sqrt(3.0f) * 0.0005f + 6e-7f) << i;
    }
    const float* normals = cs_normals(joined.client.get());
    for (std::size_t i = 0; i < sent.size(); i += 3)
      ASSERT_NEAR(std::hypot(normals[i], normals[i + 1], normals[i + 2]), 1, 1e-5);
  }
  const cs_statistics statistics = joined.client.statistics();
  EXPECT_EQ(statistics.tick, 20u);
  EXPECT_EQ(statistics.frames, 20u);
  EXPECT_EQ(statistics.key_frames, 1u);
  EXPECT_EQ(statistics.dropped, 0u);
  EXPECT_EQ(statistics.decode_errors, 0u);
  EXPECT_EQ(statistics.hash_mismatches, 0u);
}

INSTANTIATE_TEST_SUITE_P(Normals, DecodedFrames,
                         ::testing::Values(codec::NormalMode::none, codec::NormalMode::octahedral),
                         [](const auto& mode) {
                           return mode.param == codec::NormalMode::none ? "Computed" : "Sent";
                         });

TEST(Frames, MoveColliders) {
  Joined joined;
  ASSERT_EQ(cs_collider_count(joined.client.get()), 2u);
  joined.client.receive(joined.server.frame(5));
  cs_collider collider;
  ASSERT_EQ(cs_get_collider(joined.client.get(), 0, &collider), 1);
  EXPECT_STREQ(collider.name, "ball");
  EXPECT_EQ(collider.position[0], 5);
  EXPECT_EQ(collider.orientation[3], 1);
  EXPECT_EQ(collider.radius, 0.25f);
  EXPECT_EQ(cs_get_collider(joined.client.get(), 5, &collider), 0);
  collider.version = CS_COLLIDER_VERSION + 1;
  EXPECT_EQ(cs_get_collider(joined.client.get(), 0, &collider), 0);
}

TEST(Frames, SayWhichColliderYields) {
  Joined joined;
  cs_collider collider;
  for (const bool yields : {true, false}) {
    v1::Frame frame = joined.server.frameMessage(yields ? 1 : 2, codec::PacketKind::predicted);
    frame.mutable_colliders(2)->set_yields(yields);
    joined.client.receive(ScriptedServer::serialise(frame));
    ASSERT_EQ(cs_get_collider(joined.client.get(), 2, &collider), 1);
    EXPECT_EQ(collider.yields, yields ? 1 : 0);
    ASSERT_EQ(cs_get_collider(joined.client.get(), 0, &collider), 1);
    EXPECT_EQ(collider.yields, 0);
  }
}

TEST(Frames, ReadCollidersOfEveryShape) {
  Joined joined;
  joined.client.receive(joined.server.frame(5));
  const cs_client* client = joined.client.get();
  std::vector<cs_collider> colliders(cs_collider_count(client));
  ASSERT_EQ(colliders.size(), 5u);
  for (std::uint32_t i = 0; i < colliders.size(); ++i) cs_get_collider(client, i, &colliders[i]);
  EXPECT_EQ(colliders[0].shape, CS_SHAPE_SPHERE);
  EXPECT_EQ(colliders[1].shape, CS_SHAPE_HULL);
  EXPECT_EQ(colliders[2].shape, CS_SHAPE_CAPSULE);
  EXPECT_EQ(colliders[2].length, 0.03f);
  EXPECT_EQ(colliders[2].participant_id, 7u);
  EXPECT_EQ(colliders[2].yields, 0);
  EXPECT_EQ(colliders[3].shape, CS_SHAPE_PLANE);
  EXPECT_EQ(colliders[4].shape, CS_SHAPE_BOX);
  EXPECT_EQ(colliders[4].size[1], 2);
}

TEST(Frames, KeepTheHullsOfTheDescription) {
  Joined joined;
  joined.client.receive(joined.server.frame(5));
  std::uint32_t vertices = 0, indices = 0;
  const std::uint32_t* triangles = nullptr;
  const float* corners = cs_get_hull(joined.client.get(), 1, &vertices, &triangles, &indices);
  ASSERT_EQ(vertices, 4u);
  EXPECT_EQ(corners[9], 3);
  EXPECT_EQ(std::vector<std::uint32_t>(triangles, triangles + indices),
            (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3, 3, 2, 1, 3, 1, 0}));
  EXPECT_EQ(cs_get_hull(joined.client.get(), 0, &vertices, &triangles, &indices), nullptr);
  EXPECT_EQ(vertices, 0u);
}

class LockstepFrames : public ::testing::Test {
 protected:
  LockstepFrames() {
    v1::ServerMessage welcome;
    welcome.ParseFromString(server.welcome());
    welcome.mutable_welcome()->set_acknowledge_every_frame(true);
    client.receive(welcome.SerializeAsString());
    client.receiveAll(server.chunks());
    client.outgoing();
  }
  std::vector<std::uint64_t> acks() {
    std::vector<std::uint64_t> ticks;
    for (const v1::ClientMessage& message : client.outgoing())
      if (message.has_frame_ack()) ticks.push_back(message.frame_ack().tick());
    return ticks;
  }

  ScriptedServer server;
  ClientUnderTest client;
};

TEST_F(LockstepFrames, AreAllAcknowledged) {
  EXPECT_EQ(cs_in_lockstep(client.get()), 1);
  for (std::uint64_t tick = 1; tick <= 10; ++tick) {
    client.receive(server.frame(tick), tick);  // us
    EXPECT_THAT(acks(), ElementsAre(tick));
  }
}

TEST_F(LockstepFrames, AreAcknowledgedWhenTheProgramHasSeenThem) {
  cs_hold_acknowledgements(client.get(), 1);
  for (std::uint64_t tick = 1; tick <= 3; ++tick) {
    client.receive(server.frame(tick));
    EXPECT_THAT(acks(), IsEmpty());
    cs_acknowledge_seen(client.get());
    cs_acknowledge_seen(client.get());
    EXPECT_THAT(acks(), ElementsAre(tick));
  }
}

TEST_F(LockstepFrames, ThatCannotBeDecodedAreAnsweredByARequestEachTime) {
  client.receive(server.frame(1));
  server.frame(2);  // lost
  for (std::uint64_t tick = 3; tick <= 5; ++tick) {
    client.outgoing();
    client.receive(server.frame(tick), tick);
    std::size_t requests = 0;
    for (const v1::ClientMessage& message : client.outgoing()) requests += message.has_key_frame_request();
    EXPECT_EQ(requests, 1u) << tick;
  }
}

TEST(Frames, AreNotHeldOutsideOfLockstep) {
  Joined joined;
  EXPECT_EQ(cs_in_lockstep(joined.client.get()), 0);
  cs_hold_acknowledgements(joined.client.get(), 1);
  joined.client.receive(joined.server.frame(1));
  EXPECT_THAT(joined.acks(), ElementsAre(1u));
}

TEST(Frames, AcknowledgesEverySecondFrameOfAFastStream) {
  Joined joined;
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick = 1; tick <= 6; ++tick) {
    joined.client.receive(joined.server.frame(tick), tick * 14 * kMs);
    for (const std::uint64_t acknowledged : joined.acks()) ticks.push_back(acknowledged);
  }
  EXPECT_THAT(ticks, ElementsAre(1, 3, 5));
}

TEST(Frames, AcknowledgesEachFrameOfASlowStream) {
  Joined joined;
  for (std::uint64_t tick = 1; tick <= 4; ++tick) {
    joined.client.receive(joined.server.frame(tick), tick * 28 * kMs);
    EXPECT_THAT(joined.acks(), ElementsAre(tick));
  }
}

// Otherwise a server that allows two unacknowledged frames would wait for the client, and the client for it.
TEST(Frames, NeverSkipsTwoAcknowledgementsInARow) {
  Joined joined;
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick = 1; tick <= 6; ++tick) {
    joined.client.receive(joined.server.frame(tick), kMs);
    for (const std::uint64_t acknowledged : joined.acks()) ticks.push_back(acknowledged);
  }
  EXPECT_THAT(ticks, ElementsAre(1, 3, 5));
}

TEST(Frames, AcknowledgesOnlyTheNewestFrameOnASlowTransport) {
  Joined joined;
  for (std::uint64_t tick = 1; tick <= 3; ++tick) joined.client.receive(joined.server.frame(tick));
  EXPECT_THAT(joined.acks(), ElementsAre(3));
}

TEST(Frames, CountsLostFramesFromGapsBetweenTicks) {
  Joined joined({.simulationRate = 240, .streamRate = 80});  // a frame every 3 ticks
  joined.client.receive(joined.server.frame(3));
  joined.client.receive(joined.server.frame(6));
  EXPECT_EQ(joined.client.statistics().dropped, 0u);
  joined.client.receive(joined.server.frame(15, codec::PacketKind::key));
  EXPECT_EQ(joined.client.statistics().dropped, 2u);
}

TEST(Frames, RequestsAKeyFrameOnceWhenAReferenceIsMissing) {
  Joined joined;
  joined.client.receive(joined.server.frame(1), 0);
  joined.server.frame(2);  // lost
  EXPECT_EQ(joined.client.receive(joined.server.frame(3), 10 * kMs), 0u);
  const auto messages = joined.client.outgoing();
  ASSERT_THAT(messages, SizeIs(2));
  EXPECT_TRUE(messages[0].has_key_frame_request());
  EXPECT_EQ(messages[0].key_frame_request().epoch(), 7u);
  EXPECT_EQ(messages[1].frame_ack().tick(), 1u);
  joined.client.receive(joined.server.frame(4), 500 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 0u) << "one request is outstanding";
  EXPECT_EQ(joined.client.statistics().decode_errors, 2u);
  EXPECT_EQ(joined.client.receive(joined.server.frame(5, codec::PacketKind::key), 520 * kMs), kFrame);
  EXPECT_EQ(joined.client.receive(joined.server.frame(6), 530 * kMs), kFrame);
}

TEST(Frames, RequestsAnEarlyKeyFrameOnceUntilItArrives) {
  Joined joined;
  cs_request_key_frame(joined.client.get(), 5 * kMs);
  joined.client.receive(joined.server.frame(1), 10 * kMs);
  cs_request_key_frame(joined.client.get(), 200 * kMs);
  cs_request_key_frame(joined.client.get(), 210 * kMs);
  EXPECT_EQ(joined.client.receive(joined.server.frame(2), 220 * kMs), kFrame);
  const auto messages = joined.client.outgoing();
  std::vector<bool> early;
  for (const v1::ClientMessage& message : messages)
    if (message.has_key_frame_request()) early.push_back(message.key_frame_request().early());
  EXPECT_THAT(early, testing::ElementsAre(true, true)) << "the first frame answered the first request";
}

TEST(Frames, LimitsKeyFrameRequestsAndRepeatsAfterOneSecond) {
  Joined joined;
  joined.client.receive(joined.server.frame(1), 0);
  joined.server.frame(2);
  joined.client.receive(joined.server.frame(3), 10 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 1u);
  joined.client.receive(joined.server.frame(4), 1009 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 0u);
  joined.client.receive(joined.server.frame(5), 1010 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 1u);
  joined.client.receive(joined.server.frame(6, codec::PacketKind::key), 1020 * kMs);
  joined.server.frame(7);
  joined.client.receive(joined.server.frame(8), 1109 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 0u) << "99 ms after the last request";
  joined.client.receive(joined.server.frame(9), 1110 * kMs);
  EXPECT_EQ(joined.keyFrameRequests(), 1u);
}

TEST(Frames, CountsHashMismatchAndRequestsAKeyFrame) {
  Joined joined;
  v1::Frame frame = joined.server.frameMessage(1, codec::PacketKind::key);
  EXPECT_EQ(joined.client.receive(ScriptedServer::serialise(frame)), kFrame);
  EXPECT_EQ(cs_reconstruction_hash(joined.client.get()), frame.reconstruction_hash());
  EXPECT_EQ(joined.keyFrameRequests(), 0u);
  frame = joined.server.frameMessage(2, codec::PacketKind::predicted);
  frame.set_reconstruction_hash(frame.reconstruction_hash() + 1);
  EXPECT_EQ(joined.client.receive(ScriptedServer::serialise(frame)), kFrame);
  EXPECT_EQ(joined.client.statistics().hash_mismatches, 1u);
  EXPECT_EQ(joined.keyFrameRequests(), 1u);
}

TEST(Frames, RefusesMalformedPacketAndContinues) {
  Joined joined;
  joined.client.receive(joined.server.frame(1));
  v1::Frame garbage;
  garbage.set_packet("garbage");
  EXPECT_EQ(joined.client.receive(ScriptedServer::serialise(garbage)), 0u);
  EXPECT_EQ(joined.client.statistics().decode_errors, 1u);
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_JOINED);
  EXPECT_EQ(joined.client.receive(joined.server.frame(2)), kFrame);
}

TEST(Frames, IgnoresRepeatedFrame) {
  Joined joined;
  const std::string first = joined.server.frame(1);
  joined.client.receive(first);
  joined.client.receive(joined.server.frame(2));
  joined.acks();
  EXPECT_EQ(joined.client.receive(first), 0u);
  EXPECT_THAT(joined.acks(), IsEmpty());
  EXPECT_EQ(joined.client.statistics().decode_errors, 0u);
}

TEST(Frames, RefusesFrameOfAnotherEpoch) {
  Joined joined;
  ScriptedServer other({.epoch = 6});
  EXPECT_EQ(joined.client.receive(other.frame(1)), 0u);
  EXPECT_EQ(joined.client.statistics().decode_errors, 1u);
  EXPECT_EQ(joined.keyFrameRequests(), 1u);
}

TEST(Frames, FollowsChangeOfQuality) {
  Joined joined({.qualities = 3});
  std::uint32_t quality = 9;
  ASSERT_EQ(cs_get_quality(joined.client.get(), &quality), 1);
  EXPECT_EQ(quality, 0u);
  joined.client.receive(joined.server.frame(1));
  joined.client.receive(joined.server.frame(2));
  joined.server.goTo(2);
  EXPECT_EQ(joined.client.receive(ScriptedServer::operatingPoint(2)), 0u);
  for (std::uint64_t tick = 3; tick <= 5; ++tick)
    EXPECT_EQ(joined.client.receive(joined.server.frame(tick)), kFrame);
  cs_get_quality(joined.client.get(), &quality);
  EXPECT_EQ(quality, 2u);
  const cs_statistics statistics = joined.client.statistics();
  EXPECT_EQ(statistics.decode_errors, 0u);
  EXPECT_EQ(statistics.hash_mismatches, 0u);
  EXPECT_EQ(statistics.dropped, 0u);
}

TEST(Statistics, RatesCoverTheLastSecond) {
  Joined joined;
  std::uint64_t nowUs = 0;
  std::uint64_t bytes = 0, bytesOfLastSecond = 0;
  for (std::uint64_t tick = 1; tick <= 100; ++tick) {
    nowUs = tick * 20 * kMs;  // 50 frames/s
    const v1::Frame frame = joined.server.frameMessage(tick, codec::PacketKind::predicted);
    joined.client.receive(ScriptedServer::serialise(frame), nowUs);
    bytes += frame.packet().size();
    if (tick > 50) bytesOfLastSecond += frame.packet().size();
  }
  const cs_statistics statistics = joined.client.statistics(nowUs);
  EXPECT_DOUBLE_EQ(statistics.frames_per_second, 50);
  EXPECT_NEAR(statistics.kbit_per_second, static_cast<double>(bytesOfLastSecond) * 8 / 1000, 1e-9);
  EXPECT_NEAR(statistics.bits_per_vertex, static_cast<double>(bytes) * 8 / (100 * 63), 1e-9);
  EXPECT_EQ(statistics.bytes, bytes);
  EXPECT_DOUBLE_EQ(cs_stream_seconds(joined.client.get()), 99 * 0.02);
  // A stopped stream has a rate of zero.
  EXPECT_EQ(joined.client.statistics(nowUs + 1000 * kMs).frames_per_second, 0);
}

TEST(Statistics, ShowsRateOfNewStream) {
  Joined joined;
  for (std::uint64_t tick = 1; tick <= 25; ++tick)
    joined.client.receive(joined.server.frame(tick), tick * 20 * kMs);
  EXPECT_NEAR(joined.client.statistics(500 * kMs).frames_per_second, 50, 2.1);
}

TEST(Statistics, DecodeTimeNeedsAClock) {
  Joined joined;
  joined.client.receive(joined.server.frame(1));
  EXPECT_EQ(joined.client.statistics().decode_ms, 0);
  static std::uint64_t clockUs;
  clockUs = 0;
  cs_set_clock(joined.client.get(), [] { return clockUs += 500; });
  joined.client.receive(joined.server.frame(2));
  EXPECT_DOUBLE_EQ(joined.client.statistics().decode_ms, 0.5);
}

// At a change of the divisor, the larger distance between frames counts.
TEST(Frames, FramesThatAnOverloadedServerOmitsAreNotDropped) {
  Joined joined;
  EXPECT_EQ(cs_frame_divisor(joined.client.get()), 1u);
  std::uint64_t tick = 0;
  const auto receive = [&](std::uint64_t ticks, std::uint32_t divisor) {
    tick += ticks;
    v1::Frame frame = joined.server.frameMessage(
        tick, tick == ticks ? codec::PacketKind::key : codec::PacketKind::predicted);
    frame.set_frame_divisor(divisor);
    EXPECT_EQ(joined.client.receive(ScriptedServer::serialise(frame), tick * 14 * kMs), kFrame);
  };
  for (int i = 0; i < 3; ++i) receive(1, 0);
  for (int i = 0; i < 3; ++i) receive(4, 4);
  EXPECT_EQ(cs_frame_divisor(joined.client.get()), 4u);
  for (int i = 0; i < 3; ++i) receive(1, 0);
  receive(4, 4);
  EXPECT_EQ(joined.client.statistics().dropped, 0u);
  receive(8, 4);
  EXPECT_EQ(joined.client.statistics().dropped, 1u);
}

TEST(Frames, DivisorOfZeroMeansAllFrames) {
  Joined joined;
  v1::Frame frame = joined.server.frameMessage(2, codec::PacketKind::key);
  // proto3 leaves a 0 out, but other programs may write it.
  v1::Frame::GetReflection()->MutableUnknownFields(&frame)->AddVarint(v1::Frame::kFrameDivisorFieldNumber, 0);
  EXPECT_EQ(joined.client.receive(ScriptedServer::serialise(frame)), kFrame);
  EXPECT_EQ(cs_frame_divisor(joined.client.get()), 1u);
}

TEST(Frames, RefusesAnImpossibleDivisor) {
  Joined joined;
  v1::Frame frame = joined.server.frameMessage(2, codec::PacketKind::key);
  frame.set_frame_divisor(4'000'000'000u);
  joined.client.receive(ScriptedServer::serialise(frame));
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
}

}  // namespace
}  // namespace clothstream::client
