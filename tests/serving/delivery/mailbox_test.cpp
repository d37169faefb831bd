// SPDX-License-Identifier: MIT
// Order of the messages to a subscriber, and the cost of one that does not read.
#include "server/delivery/mailbox.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "proto/datagram/piece.h"

namespace clothstream::delivery {
namespace {

using namespace schedule;

using std::chrono::milliseconds;

SharedBytes bytes(std::size_t size) {
  return std::make_shared<std::vector<std::byte>>(size);
}

class MailboxTest : public ::testing::Test {
 protected:
  MailboxTest() : mailbox([this] { ++wakes; }) {}

  // Subscribes with a description of one chunk, and takes it.
  void join() {
    mailbox.subscribe(description(1), shape, metrics);
    ASSERT_TRUE(mailbox.next(now));
    ASSERT_FALSE(mailbox.next(now));
  }
  // The same, and acknowledges this key frame. The next frames leave by a link with room.
  void joinByLink(const PublishedFrame& first) {
    join();
    mailbox.setFrameWake([this] { ++frameWakes; });
    mailbox.deliver(first);
    ASSERT_EQ(mailbox.next(now), first.message);
    ASSERT_FALSE(mailbox.next(now));
    ASSERT_TRUE(mailbox.acknowledge(first.tick, now));
    mailbox.setLink(Mailbox::Link{.hasRoom = true, .frameRate = 1e6});
  }
  static std::shared_ptr<const DescriptionChunks> description(std::size_t bytes) {
    return std::make_shared<const DescriptionChunks>(1, std::make_shared<const std::string>(bytes, 'g'),
                                                     "rest");
  }
  bool wantsKeyFrame() { return mailbox.requested(now).keyFrames != 0; }
  PublishedFrame frame(std::uint64_t tick, bool key = false) {
    return {.message = bytes(100), .tick = tick, .key = key, .referenceTick = tick - 1, .complete = now};
  }
  // Ticks of the frames that next() returns until it has no more.
  std::vector<std::uint64_t> taken(const std::vector<PublishedFrame>& published) {
    std::vector<std::uint64_t> ticks;
    while (const auto message = mailbox.next(now))
      for (const PublishedFrame& candidate : published)
        if (candidate.message == *message) ticks.push_back(candidate.tick);
    return ticks;
  }

  StreamShape shape{.rate = 72};
  Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  telemetry::SceneMetrics metrics;
  int wakes = 0, frameWakes = 0;
  Mailbox mailbox;
};

using Ticks = std::vector<std::uint64_t>;

TEST_F(MailboxTest, SendsRepliesThenDescriptionThenAnnouncementsThenFrames) {
  const SharedBytes welcome = bytes(1), announcement = bytes(4), pong = bytes(5);
  ASSERT_TRUE(mailbox.reply(welcome));
  const auto content = description(256 * 1024);
  ASSERT_EQ(content->count(), 2u);
  mailbox.subscribe(content, shape, metrics);
  mailbox.announce(announcement);
  EXPECT_FALSE(wantsKeyFrame());
  mailbox.deliver(frame(1, true));  // a frame before the description is useless
  EXPECT_EQ(mailbox.next(now), welcome);
  EXPECT_EQ(**mailbox.next(now), *content->chunk(0));
  ASSERT_TRUE(mailbox.reply(pong));
  EXPECT_EQ(mailbox.next(now), pong);
  EXPECT_EQ(**mailbox.next(now), *content->chunk(1));
  EXPECT_EQ(mailbox.next(now), announcement);
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(wantsKeyFrame());
  const PublishedFrame key = frame(2, true);
  mailbox.deliver(key);
  EXPECT_EQ(mailbox.next(now), key.message);
}

// Changes that others make again and again must not displace the frames.
TEST_F(MailboxTest, FramesComeBetweenManyAnnouncements) {
  join();
  const std::size_t half = ControlMessages::kMaxAnnouncedBytes / 2;
  for (std::uint64_t tick = 1; tick <= 5; ++tick) {
    for (int i = 0; i < 4; ++i) mailbox.announce(bytes(half));
    const PublishedFrame next = frame(tick, tick == 1);
    mailbox.deliver(next);
    EXPECT_EQ((*mailbox.next(now))->size(), half);
    EXPECT_EQ((*mailbox.next(now))->size(), half);
    EXPECT_EQ(mailbox.next(now), next.message);
    EXPECT_TRUE(mailbox.acknowledge(tick, now));
  }
  int rest = 0;
  while (mailbox.next(now)) ++rest;
  EXPECT_EQ(rest, 10) << "without a frame they are sent at once";
}

// Whether the frame waits already when the announcements are taken changes nothing.
TEST_F(MailboxTest, AnnouncementsComeBeforeTheFrameInLockstep) {
  shape.lockstep = true;
  join();
  for (const bool early : {false, true}) {
    for (int i = 0; i < 4; ++i) mailbox.announce(bytes(ControlMessages::kMaxAnnouncedBytes));
    const PublishedFrame next = frame(early ? 2 : 1, !early);
    if (early) mailbox.deliver(next);
    for (int i = 0; i < 4; ++i)
      EXPECT_EQ((*mailbox.next(now))->size(), ControlMessages::kMaxAnnouncedBytes) << early << i;
    if (!early) mailbox.deliver(next);
    EXPECT_EQ(mailbox.next(now), next.message) << early;
    EXPECT_TRUE(mailbox.acknowledge(next.tick, now));
  }
}

TEST_F(MailboxTest, StartsWithAKeyFrame) {
  join();
  mailbox.deliver(frame(5));
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(wantsKeyFrame());
  mailbox.deliver(frame(6, true));
  EXPECT_FALSE(wantsKeyFrame());
  EXPECT_TRUE(mailbox.next(now));
}

constexpr Mailbox::Link kRoom{.hasRoom = true, .frameRate = 1e6}, kNoRoom{.frameRate = 1e6};

// The room of a rate controller counts, and not the number of frames on their way.
TEST_F(MailboxTest, LinkGivesTheRoom) {
  const std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3), frame(4), frame(5), frame(6)};
  joinByLink(frames[0]);
  for (std::size_t i = 1; i < 4; ++i) {
    mailbox.deliver(frames[i]);
    EXPECT_EQ(mailbox.nextFrame(now), frames[i].message);
  }
  mailbox.setLink(kNoRoom);
  mailbox.deliver(frames[4]);
  EXPECT_FALSE(mailbox.nextFrame(now));
  EXPECT_TRUE(mailbox.acknowledge(4, now));
  EXPECT_FALSE(mailbox.nextFrame(now));
  const int before = frameWakes;
  mailbox.setLink(kRoom);
  EXPECT_EQ(frameWakes, before + 1);
  EXPECT_EQ(mailbox.nextFrame(now), frames[4].message);
  EXPECT_TRUE(mailbox.acknowledge(5, now));
  mailbox.setLink(std::nullopt);
  mailbox.deliver(frames[5]);
  EXPECT_FALSE(mailbox.nextFrame(now));
  EXPECT_EQ(taken(frames), Ticks{6}) << "the stream's window has room";
  EXPECT_FALSE(mailbox.wantsFinerQuality());
}

// A peer that sends receipts, but acknowledges no frames.
TEST_F(MailboxTest, LinkBoundsUnacknowledgedFrames) {
  joinByLink(frame(1, true));
  std::size_t sent = 0;
  for (std::uint64_t tick = 2; tick <= 2 * SendWindow::kMax; ++tick) {
    mailbox.deliver(frame(tick));
    while (mailbox.nextFrame(now)) ++sent;
  }
  EXPECT_EQ(sent, SendWindow::kMax);
}

// A peer that has acknowledged no frame may not have the description yet.
TEST_F(MailboxTest, FirstFrameTravelsOnStream) {
  join();
  mailbox.setFrameWake([this] { ++frameWakes; });
  mailbox.setLink(kRoom);
  const std::vector<PublishedFrame> frames{frame(1, true), frame(2)};
  mailbox.deliver(frames[0]);
  EXPECT_FALSE(mailbox.nextFrame(now));
  EXPECT_EQ(taken(frames), Ticks{1});
  EXPECT_TRUE(mailbox.acknowledge(1, now));
  mailbox.deliver(frames[1]);
  EXPECT_EQ(taken(frames), Ticks{});
  EXPECT_EQ(frameWakes, 1);
  EXPECT_EQ(mailbox.nextFrame(now), frames[1].message);
}

TEST_F(MailboxTest, LongFrameTravelsOnStreamInOrder) {
  std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3), frame(4)};
  frames[2].message = bytes(datagram::kMaxFrameBytes + 1);
  joinByLink(frames[0]);
  mailbox.deliver(frames[1]);
  const int before = wakes;
  mailbox.deliver(frames[2]);
  mailbox.deliver(frames[3]);
  EXPECT_EQ(taken(frames), Ticks{}) << "the frame before it has not left";
  EXPECT_EQ(mailbox.nextFrame(now), frames[1].message);
  EXPECT_FALSE(mailbox.nextFrame(now));
  EXPECT_EQ(wakes, before + 1);
  const int frameBefore = frameWakes;
  EXPECT_EQ(taken(frames), Ticks{3});
  EXPECT_EQ(frameWakes, frameBefore + 1);
  EXPECT_EQ(mailbox.nextFrame(now), frames[3].message);
}

// Frames that have not left by the link leave by the stream.
TEST_F(MailboxTest, HeldFramesReturnToStream) {
  const std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3)};
  joinByLink(frames[0]);
  mailbox.deliver(frames[1]);
  EXPECT_EQ(mailbox.nextFrame(now), frames[1].message);
  EXPECT_TRUE(mailbox.acknowledge(2, now));
  mailbox.setLink(kNoRoom);
  mailbox.deliver(frames[2]);
  const int before = wakes;
  mailbox.setLink(std::nullopt);
  EXPECT_EQ(wakes, before + 1);
  EXPECT_FALSE(mailbox.nextFrame(now));
  EXPECT_EQ(taken(frames), Ticks{3});
}

// The peer may never get what the link has lost, so no acknowledgement may come either.
TEST_F(MailboxTest, StreamBeginsWithKeyFrameAfterLoss) {
  const std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3), frame(4, true)};
  joinByLink(frames[0]);
  mailbox.deliver(frames[1]);
  EXPECT_EQ(mailbox.nextFrame(now), frames[1].message);
  mailbox.setLink(std::nullopt);
  EXPECT_TRUE(wantsKeyFrame());
  mailbox.deliver(frames[2]);
  EXPECT_EQ(taken(frames), Ticks{});
  mailbox.deliver(frames[3]);
  EXPECT_EQ(taken(frames), Ticks{4});
  EXPECT_TRUE(mailbox.acknowledge(2, now)) << "it had arrived";
}

TEST_F(MailboxTest, StreamTellsQualityOfLink) {
  shape.qualities = 2;
  joinByLink(frame(1, true));
  mailbox.setLink(Mailbox::Link{.hasRoom = true, .frameRate = 1});
  const auto deliver = [&](std::uint64_t tick) {
    now += milliseconds(14);
    const RequestedFrames requested = mailbox.requested(now);
    PublishedFrame next = frame(tick, requested.keyFrames != 0);
    next.quality = (requested.keyFrames & 2) != 0 || requested.qualities == 2 ? 1 : 0;
    mailbox.deliver(next);
    const std::optional<SharedBytes> sent = mailbox.nextFrame(now);
    EXPECT_TRUE(!sent || mailbox.acknowledge(tick, now));
    return sent ? next.quality : std::uint8_t{0};
  };
  std::uint64_t tick = 2;
  while (tick < 200 && deliver(tick) == 0) ++tick;
  const std::optional<SharedBytes> told = mailbox.next(now);
  ASSERT_TRUE(told) << "after " << tick << " frames";
  v1::ServerMessage message;
  ASSERT_TRUE(message.ParseFromArray((*told)->data(), static_cast<int>((*told)->size())));
  EXPECT_EQ(message.operating_point().quality(), 1u);
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(mailbox.wantsFinerQuality());
}

// A key frame costs all subscribers, so both outlets must have sent what they have.
TEST_F(MailboxTest, KeyFrameWaitsForBothOutlets) {
  joinByLink(frame(1, true));
  mailbox.restart();
  EXPECT_NE(mailbox.needsKeyFrame(), 0);
  EXPECT_TRUE(mailbox.reply(bytes(10)));
  EXPECT_EQ(mailbox.needsKeyFrame(), 0);
  EXPECT_TRUE(mailbox.next(now));
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_NE(mailbox.needsKeyFrame(), 0);
}

TEST_F(MailboxTest, SendsTwoFramesWithoutAcknowledgement) {
  join();
  const std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3), frame(4)};
  mailbox.deliver(frames[0]);
  mailbox.deliver(frames[1]);
  EXPECT_EQ(taken(frames), (Ticks{1, 2}));
  mailbox.deliver(frames[2]);
  mailbox.deliver(frames[3]);
  EXPECT_EQ(taken(frames), Ticks{});
  EXPECT_TRUE(mailbox.acknowledge(1, now));
  EXPECT_EQ(taken(frames), (Ticks{3}));
  EXPECT_TRUE(mailbox.acknowledge(3, now));  // acknowledges all earlier frames too
  EXPECT_EQ(taken(frames), (Ticks{4}));
}

TEST_F(MailboxTest, RefusesAcknowledgementOfUnsentFrame) {
  join();
  mailbox.deliver(frame(1, true));
  EXPECT_FALSE(mailbox.acknowledge(1, now));
  ASSERT_TRUE(mailbox.next(now));
  EXPECT_TRUE(mailbox.acknowledge(1, now));
  EXPECT_FALSE(mailbox.acknowledge(2, now));
}

TEST_F(MailboxTest, WindowGrowsWithTheMinimumRoundTripTime) {
  join();
  std::uint64_t tick = 0;
  const auto inFlight = [&] {
    std::vector<PublishedFrame> frames;
    Ticks ticks;
    for (int i = 0; i < 40; ++i) {
      mailbox.deliver(frame(++tick, i == 0));
      if (mailbox.next(now)) ticks.push_back(tick);
    }
    return ticks;
  };
  EXPECT_EQ(inFlight().size(), SendWindow::kMin);
  // A round trip of 50 ms takes 3.6 frames at 72 frames per second.
  mailbox.restart();
  mailbox.deliver(frame(++tick, true));
  ASSERT_TRUE(mailbox.next(now));
  now += milliseconds(50);
  ASSERT_TRUE(mailbox.acknowledge(tick, now));
  const Ticks sent = inFlight();
  EXPECT_EQ(sent.size(), SendWindow::kMin + 4);

  // A queue on the link makes the next round trip ten times as long. The window does not grow.
  now += milliseconds(500);
  ASSERT_TRUE(mailbox.acknowledge(sent.back(), now));
  mailbox.restart();
  EXPECT_EQ(inFlight().size(), SendWindow::kMin + 4);
}

// The acknowledgements of such a peer arrive one frame later than those of a peer that acknowledges each
// frame.
TEST_F(MailboxTest, WindowGrowsByOneIfEverySecondFrameIsAcknowledged) {
  join();
  std::uint64_t tick = 0;
  const auto inFlight = [&] {
    std::size_t sent = 0;
    for (int i = 0; i < 10; ++i) {
      mailbox.deliver(frame(++tick, i == 0));
      if (mailbox.next(now)) ++sent;
    }
    return sent;
  };
  const auto afterRoundTrips = [&](std::uint64_t framesEach) {
    mailbox.restart();
    for (int i = 0; i < 4; ++i) {
      for (std::uint64_t frames = 0; frames < framesEach; ++frames) {
        mailbox.deliver(frame(++tick, i == 0 && frames == 0));
        EXPECT_TRUE(mailbox.next(now));
      }
      now += milliseconds(1);
      EXPECT_TRUE(mailbox.acknowledge(tick, now));
    }
    return inFlight();
  };
  EXPECT_EQ(afterRoundTrips(1), SendWindow::kMin + 1);  // 1 ms is shorter than a frame interval
  EXPECT_EQ(afterRoundTrips(2), SendWindow::kMin + 2);
  EXPECT_EQ(afterRoundTrips(1), SendWindow::kMin + 1);
}

TEST_F(MailboxTest, LimitsFramesInFlightToTheLargestWindow) {
  join();
  mailbox.deliver(frame(1, true));
  ASSERT_TRUE(mailbox.next(now));
  now += std::chrono::seconds(10);
  ASSERT_TRUE(mailbox.acknowledge(1, now));
  std::size_t inFlight = 0;
  for (std::uint64_t tick = 2; tick < 100; ++tick) {
    mailbox.deliver(frame(tick, tick == 2));
    inFlight += mailbox.next(now).has_value();
  }
  EXPECT_EQ(inFlight, SendWindow::kMax);
}

TEST_F(MailboxTest, PeerThatDoesNotReadRequestsNothing) {
  join();
  std::vector<PublishedFrame> frames;
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    mailbox.deliver(frames.emplace_back(frame(tick, tick == 1)));
    // The window has room and at most three frames are held. But the endpoint has not called next() since it
    // was woken, so no key frame is requested.
    EXPECT_FALSE(wantsKeyFrame());
  }
  EXPECT_EQ(metrics.framesDropped.value(), 20u);
  for (const PublishedFrame& each : frames) EXPECT_EQ(each.message.use_count(), 1) << each.tick;
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(wantsKeyFrame());
}

TEST_F(MailboxTest, HoldsALimitedNumberOfFrames) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  ASSERT_EQ(taken(frames), (Ticks{1, 2}));
  for (std::uint64_t tick = 3; tick <= 5; ++tick) mailbox.deliver(frames.emplace_back(frame(tick)));
  for (const PublishedFrame& each : frames)
    EXPECT_EQ(each.message.use_count(), each.tick < 3 ? 1 : 2) << each.tick;
  // One frame too many: all held frames are dropped. No key frame is requested while there is no room for it.
  mailbox.deliver(frames.emplace_back(frame(6)));
  for (const PublishedFrame& each : frames) EXPECT_EQ(each.message.use_count(), 1) << each.tick;
  EXPECT_EQ(metrics.framesDropped.value(), 4u);
  EXPECT_FALSE(wantsKeyFrame());
  ASSERT_TRUE(mailbox.acknowledge(2, now));
  EXPECT_TRUE(wantsKeyFrame());
  EXPECT_EQ(taken(frames), Ticks{});
  mailbox.deliver(frames.emplace_back(frame(7, true)));
  EXPECT_EQ(taken(frames), Ticks{7});
}

TEST_F(MailboxTest, SendsOnlyFramesWhoseReferenceWasSent) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2)};
  frames.push_back(frame(4));  // refers to 3, which never came
  frames.push_back(frame(5));
  for (const PublishedFrame& each : frames) {
    mailbox.deliver(each);
    if (each.tick <= 2) {
      EXPECT_EQ(taken(frames), Ticks{each.tick});
    }
    (void)mailbox.acknowledge(each.tick, now);
  }
  EXPECT_EQ(taken(frames), Ticks{});
  EXPECT_TRUE(wantsKeyFrame());
}

TEST_F(MailboxTest, KeyFrameReplacesHeldFrames) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3), frame(4, true)};
  for (const PublishedFrame& each : frames) {
    mailbox.deliver(each);
    if (each.tick == 2) {
      EXPECT_EQ(taken(frames), (Ticks{1, 2}));
    }
  }
  ASSERT_TRUE(mailbox.acknowledge(2, now));
  EXPECT_EQ(taken(frames), Ticks{4});
}

TEST_F(MailboxTest, RestartBeginsWithAKeyFrame) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  EXPECT_EQ(taken(frames), (Ticks{1, 2}));
  mailbox.restart();
  EXPECT_TRUE(wantsKeyFrame());
  EXPECT_EQ(taken(frames), Ticks{});
  mailbox.deliver(frames.emplace_back(frame(4)));
  mailbox.deliver(frames.emplace_back(frame(5, true)));
  EXPECT_EQ(taken(frames), Ticks{5});
}

TEST_F(MailboxTest, RestartsAreMergedUntilTheKeyFrame) {
  join();
  EXPECT_TRUE(mailbox.isRestarting()) << "its first frame is a key frame";
  std::vector<PublishedFrame> frames{frame(1, true)};
  mailbox.deliver(frames[0]);
  EXPECT_EQ(taken(frames), Ticks{1});
  EXPECT_FALSE(mailbox.isRestarting());
  mailbox.restart();
  EXPECT_TRUE(mailbox.isRestarting());
  mailbox.deliver(frames.emplace_back(frame(2)));
  EXPECT_TRUE(mailbox.isRestarting());
  mailbox.deliver(frames.emplace_back(frame(3, true)));
  EXPECT_FALSE(mailbox.isRestarting());
}

TEST_F(MailboxTest, SlowReaderThatMustContinueWithAKeyFrameIsNotRestarting) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  EXPECT_EQ(taken(frames), (Ticks{1, 2}));
  for (std::uint64_t tick = 3; tick <= 6; ++tick) mailbox.deliver(frames.emplace_back(frame(tick)));
  ASSERT_FALSE(wantsKeyFrame()) << "no room";
  EXPECT_FALSE(mailbox.isRestarting()) << "a restart would make room";
}

TEST_F(MailboxTest, KeepsSendingFramesUntilTheRequestedKeyFrame) {
  join();
  std::vector<PublishedFrame> frames;
  std::uint64_t tick = 0;
  const auto stream = [&](bool key) {
    ++tick;
    mailbox.deliver(frames.emplace_back(frame(tick, key)));
    EXPECT_EQ(taken(frames), Ticks{tick});
    EXPECT_TRUE(mailbox.acknowledge(tick, now));
  };
  stream(true);
  EXPECT_FALSE(wantsKeyFrame());
  for (std::uint32_t i = 0; i < Mailbox::kMinKeyFrameDistance; ++i) {
    mailbox.requestKeyFrame();
    EXPECT_FALSE(wantsKeyFrame()) << i << " frames after a key frame";
    stream(false);
  }
  EXPECT_TRUE(wantsKeyFrame());
  stream(false);
  EXPECT_TRUE(wantsKeyFrame());
  stream(true);
  EXPECT_FALSE(wantsKeyFrame());
}

TEST_F(MailboxTest, LimitsControlMessages) {
  std::size_t accepted = 0;
  while (mailbox.reply(bytes(1024))) ++accepted;
  EXPECT_EQ(accepted, ControlMessages::kMaxBytes / (1024 + ControlMessages::kMessageOverhead));
  ASSERT_TRUE(mailbox.next(now));
  EXPECT_TRUE(mailbox.reply(bytes(1024)));
}

TEST_F(MailboxTest, AcceptsOneMessageLargerThanTheLimit) {
  EXPECT_TRUE(mailbox.reply(bytes(ControlMessages::kMaxBytes * 2)));
  EXPECT_FALSE(mailbox.reply(bytes(1)));
}

TEST_F(MailboxTest, LimitsHeldBytes) {
  join();
  const auto large = [&](std::uint64_t tick, std::size_t size) {
    PublishedFrame made = frame(tick, tick == 1);
    made.message = bytes(size);
    return made;
  };
  // A single frame is dropped too if it is larger than the limit.
  std::vector<PublishedFrame> frames{large(1, 2 * HeldFrames::kMaxBytes), large(2, 1)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  EXPECT_EQ(frames[0].message.use_count(), 1);
  EXPECT_EQ(metrics.framesDropped.value(), 2u);
  frames = {large(1, HeldFrames::kMaxBytes / 2), large(2, HeldFrames::kMaxBytes / 2), large(3, 1)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  for (const PublishedFrame& each : frames) EXPECT_EQ(each.message.use_count(), 1) << each.tick;
  EXPECT_EQ(metrics.framesDropped.value(), 5u);
}

TEST_F(MailboxTest, SendsTheRequestedQualityAndReportsIt) {
  shape = {.rate = 72, .qualities = 2};
  mailbox.subscribe(nullptr, shape, metrics, 1);
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_EQ(mailbox.requested(now).keyFrames, 0b10);
  mailbox.deliver(frame(1, true));  // quality 0
  EXPECT_FALSE(mailbox.next(now));
  PublishedFrame wanted = frame(2, true);
  wanted.quality = 1;
  mailbox.deliver(wanted);
  v1::ServerMessage parsed;
  const auto first = mailbox.next(now);
  ASSERT_TRUE(first && parsed.ParseFromArray((*first)->data(), static_cast<int>((*first)->size())));
  EXPECT_EQ(parsed.operating_point().quality(), 1u);
  EXPECT_EQ(mailbox.next(now), wanted.message);
  const RequestedFrames requested = mailbox.requested(now);
  EXPECT_EQ(requested.qualities, 0b10);
  EXPECT_EQ(requested.keyFrames, 0);
}

TEST_F(MailboxTest, SendsNoTickInTwoQualities) {
  shape = {.rate = 72, .qualities = 2};
  mailbox.subscribe(nullptr, shape, metrics);
  EXPECT_FALSE(mailbox.next(now));
  const std::vector<PublishedFrame> fine{frame(1, true), frame(2), frame(3), frame(4)};
  for (std::size_t i = 0; i < 3; ++i) mailbox.deliver(fine[i]);
  EXPECT_EQ(taken(fine), (Ticks{1, 2}));
  now += LinkAdaptation::kPatience;
  EXPECT_EQ(mailbox.requested(now).keyFrames, 0b10);  // the subscriber is behind, so it shall get quality 1
  ASSERT_TRUE(mailbox.acknowledge(2, now));
  EXPECT_EQ(taken(fine), Ticks{3});
  mailbox.deliver(fine[3]);
  EXPECT_EQ(taken(fine), Ticks{4});

  PublishedFrame same = frame(4, true), next = frame(5, true);
  same.quality = next.quality = 1;
  ASSERT_TRUE(mailbox.acknowledge(4, now));
  mailbox.deliver(same);
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_EQ(mailbox.requested(now).keyFrames, 0b10);
  mailbox.deliver(next);
  EXPECT_EQ(taken({same, next}), Ticks{5});
}

TEST_F(MailboxTest, RestartedPeerMayReceiveATickTwice) {
  join();
  const PublishedFrame first = frame(1, true);
  PublishedFrame again = frame(1, true);
  again.repeated = true;
  mailbox.deliver(first);
  EXPECT_EQ(taken({first}), Ticks{1});
  mailbox.restart();
  mailbox.deliver(again);
  EXPECT_EQ(taken({again}), Ticks{1});
}

TEST_F(MailboxTest, ClosedMailboxSendsItsLastMessageAndAcceptsNoMore) {
  join();
  mailbox.deliver(frame(1, true));
  mailbox.announce(bytes(1));
  const SharedBytes last = bytes(7);
  mailbox.close(last);
  EXPECT_TRUE(mailbox.closed());
  EXPECT_TRUE(mailbox.reply(bytes(1)));
  mailbox.close(bytes(8));
  EXPECT_EQ(mailbox.next(now), last);
  EXPECT_FALSE(mailbox.next(now));
}

TEST_F(MailboxTest, WakesOnlyIfAMessageCanBeTaken) {
  join();
  wakes = 0;
  mailbox.deliver(frame(1, true));
  mailbox.deliver(frame(2));
  EXPECT_EQ(wakes, 2);
  ASSERT_TRUE(mailbox.next(now));
  ASSERT_TRUE(mailbox.next(now));
  mailbox.deliver(frame(3));  // the window has no room
  EXPECT_EQ(wakes, 2);
  ASSERT_TRUE(mailbox.acknowledge(1, now));
  EXPECT_EQ(wakes, 3);
  mailbox.silence();
  mailbox.close(bytes(1));
  EXPECT_EQ(wakes, 3);
}

}  // namespace
}  // namespace clothstream::delivery
