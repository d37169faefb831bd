// SPDX-License-Identifier: MIT
// What a subscriber is sent, in which order, and what it costs when it does not read.
#include "server/stream/mailbox.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::stream {
namespace {

using std::chrono::milliseconds;

SharedBytes bytes(std::size_t size) {
  return std::make_shared<std::vector<std::byte>>(size);
}

class MailboxTest : public ::testing::Test {
 protected:
  MailboxTest() : mailbox([this] { ++wakes; }) {}

  // Description of one chunk, which is taken at once.
  void join() {
    auto description = std::make_shared<Description>();
    description->chunks.push_back(bytes(1));
    mailbox.subscribe(description, 72, metrics);
    ASSERT_TRUE(mailbox.next(now));
    ASSERT_FALSE(mailbox.next(now));
  }
  PublishedFrame frame(std::uint64_t tick, bool key = false) {
    return {.message = bytes(100), .tick = tick, .key = key, .referenceTick = tick - 1, .complete = now};
  }
  // Ticks of the frames that next() gives until it has no more.
  std::vector<std::uint64_t> taken(const std::vector<PublishedFrame>& published) {
    std::vector<std::uint64_t> ticks;
    while (const auto message = mailbox.next(now))
      for (const PublishedFrame& candidate : published)
        if (candidate.message == *message) ticks.push_back(candidate.tick);
    return ticks;
  }

  Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  telemetry::SceneMetrics metrics;
  int wakes = 0;
  Mailbox mailbox;
};

using Ticks = std::vector<std::uint64_t>;

TEST_F(MailboxTest, GivesAnswersThenTheDescriptionThenAnnouncementsThenFrames) {
  const SharedBytes welcome = bytes(1), chunk = bytes(2), second = bytes(3), told = bytes(4), pong = bytes(5);
  ASSERT_TRUE(mailbox.reply(welcome));
  auto description = std::make_shared<Description>();
  description->chunks = {chunk, second};
  mailbox.subscribe(description, 72, metrics);
  ASSERT_TRUE(mailbox.announce(told));
  EXPECT_FALSE(mailbox.wantsKeyFrame());
  mailbox.deliver(frame(1, true));  // before the description is out, a frame would be of no use
  EXPECT_EQ(mailbox.next(now), welcome);
  EXPECT_EQ(mailbox.next(now), chunk);
  ASSERT_TRUE(mailbox.reply(pong));
  EXPECT_EQ(mailbox.next(now), pong);
  EXPECT_EQ(mailbox.next(now), second);
  EXPECT_EQ(mailbox.next(now), told);
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  const PublishedFrame key = frame(2, true);
  mailbox.deliver(key);
  EXPECT_EQ(mailbox.next(now), key.message);
}

TEST_F(MailboxTest, StartsWithAKeyFrame) {
  join();
  mailbox.deliver(frame(5));
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  mailbox.deliver(frame(6, true));
  EXPECT_FALSE(mailbox.wantsKeyFrame());
  EXPECT_TRUE(mailbox.next(now));
}

TEST_F(MailboxTest, LeavesTwoFramesUnacknowledged) {
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
  EXPECT_TRUE(mailbox.acknowledge(3, now));  // of the newest, for all before it
  EXPECT_EQ(taken(frames), (Ticks{4}));
}

TEST_F(MailboxTest, RefusesAnAcknowledgementOfWhatWasNotSent) {
  join();
  mailbox.deliver(frame(1, true));
  EXPECT_FALSE(mailbox.acknowledge(1, now));
  ASSERT_TRUE(mailbox.next(now));
  EXPECT_TRUE(mailbox.acknowledge(1, now));
  EXPECT_FALSE(mailbox.acknowledge(2, now));
}

TEST_F(MailboxTest, WidensItsWindowByTheRoundTripAndNoFarther) {
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
  EXPECT_EQ(inFlight().size(), Mailbox::kMinWindow);
  // 50 ms at 72 frames/s are 3.6 frames.
  mailbox.restart();
  mailbox.deliver(frame(++tick, true));
  ASSERT_TRUE(mailbox.next(now));
  now += milliseconds(50);
  ASSERT_TRUE(mailbox.acknowledge(tick, now));
  const Ticks sent = inFlight();
  EXPECT_EQ(sent.size(), Mailbox::kMinWindow + 4);

  // A queue on the way makes the next round trip ten times as long: the window hardly moves.
  now += milliseconds(500);
  ASSERT_TRUE(mailbox.acknowledge(sent.back(), now));
  mailbox.restart();
  EXPECT_EQ(inFlight().size(), Mailbox::kMinWindow + 4);
}

TEST_F(MailboxTest, NeverHasMoreThanTheLargestWindowInFlight) {
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
  EXPECT_EQ(inFlight, Mailbox::kMaxWindow);
}

TEST_F(MailboxTest, WhoDoesNotReadHoldsNothingAndAsksForNothing) {
  join();
  std::vector<PublishedFrame> frames;
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    mailbox.deliver(frames.emplace_back(frame(tick, tick == 1)));
    // There is room, and three frames were held at most: but the door has not come to ask since it was woken.
    EXPECT_FALSE(mailbox.wantsKeyFrame());
  }
  EXPECT_EQ(metrics.framesDropped.value(), 20u);
  for (const PublishedFrame& each : frames) EXPECT_EQ(each.message.use_count(), 1) << each.tick;
  EXPECT_FALSE(mailbox.next(now));
  EXPECT_TRUE(mailbox.wantsKeyFrame());
}

TEST_F(MailboxTest, HoldsBackAsManyFramesAsItSaysAndNoMore) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  ASSERT_EQ(taken(frames), (Ticks{1, 2}));
  for (std::uint64_t tick = 3; tick <= 5; ++tick) mailbox.deliver(frames.emplace_back(frame(tick)));
  for (const PublishedFrame& each : frames)
    EXPECT_EQ(each.message.use_count(), each.tick < 3 ? 1 : 2) << each.tick;
  // One too many: all that is held goes, and nobody is asked for a key frame as long as there is no room for
  // it.
  mailbox.deliver(frames.emplace_back(frame(6)));
  for (const PublishedFrame& each : frames) EXPECT_EQ(each.message.use_count(), 1) << each.tick;
  EXPECT_EQ(metrics.framesDropped.value(), 4u);
  EXPECT_FALSE(mailbox.wantsKeyFrame());
  ASSERT_TRUE(mailbox.acknowledge(2, now));
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  EXPECT_EQ(taken(frames), Ticks{});
  mailbox.deliver(frames.emplace_back(frame(7, true)));
  EXPECT_EQ(taken(frames), Ticks{7});
}

TEST_F(MailboxTest, GivesOnlyFramesWhoseReferenceItGaveBefore) {
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
  EXPECT_TRUE(mailbox.wantsKeyFrame());
}

TEST_F(MailboxTest, AKeyFrameReplacesWhatIsHeld) {
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

TEST_F(MailboxTest, WhoCannotDecodeStartsAnewWithAKeyFrame) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3)};
  for (const PublishedFrame& each : frames) mailbox.deliver(each);
  EXPECT_EQ(taken(frames), (Ticks{1, 2}));
  mailbox.restart();
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  EXPECT_EQ(taken(frames), Ticks{});
  mailbox.deliver(frames.emplace_back(frame(4)));
  mailbox.deliver(frames.emplace_back(frame(5, true)));
  EXPECT_EQ(taken(frames), Ticks{5});
}

TEST_F(MailboxTest, WhoWantsAKeyFrameEarlyGetsWhatThereIsUntilThen) {
  join();
  std::vector<PublishedFrame> frames{frame(1, true), frame(2), frame(3)};
  mailbox.deliver(frames[0]);
  EXPECT_FALSE(mailbox.wantsKeyFrame());
  mailbox.wantKeyFrame();
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  mailbox.deliver(frames[1]);
  EXPECT_TRUE(mailbox.wantsKeyFrame());
  EXPECT_EQ(taken(frames), (Ticks{1, 2}));
  ASSERT_TRUE(mailbox.acknowledge(2, now));
  mailbox.deliver(frames.emplace_back(frame(4, true)));
  EXPECT_FALSE(mailbox.wantsKeyFrame());
  EXPECT_EQ(taken(frames), Ticks{4});
}

TEST_F(MailboxTest, HasRoomForABoundedAmountOfControl) {
  std::size_t accepted = 0;
  while (mailbox.reply(bytes(1024))) ++accepted;
  EXPECT_EQ(accepted, Mailbox::kMaxControlBytes / 1024);
  ASSERT_TRUE(mailbox.next(now));
  EXPECT_TRUE(mailbox.reply(bytes(1024)));
}

TEST_F(MailboxTest, TakesOneMessageLargerThanItsBound) {
  EXPECT_TRUE(mailbox.reply(bytes(Mailbox::kMaxControlBytes * 2)));
  EXPECT_FALSE(mailbox.reply(bytes(1)));
}

TEST_F(MailboxTest, ClosedItGivesItsLastWordAndTakesNothingMore) {
  join();
  mailbox.deliver(frame(1, true));
  ASSERT_TRUE(mailbox.announce(bytes(1)));
  const SharedBytes last = bytes(7);
  mailbox.close(last);
  EXPECT_TRUE(mailbox.closed());
  EXPECT_TRUE(mailbox.reply(bytes(1)));
  mailbox.close(bytes(8));
  EXPECT_EQ(mailbox.next(now), last);
  EXPECT_FALSE(mailbox.next(now));
}

TEST_F(MailboxTest, WakesOnlyForWhatCanBeTaken) {
  join();
  wakes = 0;
  mailbox.deliver(frame(1, true));
  mailbox.deliver(frame(2));
  EXPECT_EQ(wakes, 2);
  ASSERT_TRUE(mailbox.next(now));
  ASSERT_TRUE(mailbox.next(now));
  mailbox.deliver(frame(3));  // no room
  EXPECT_EQ(wakes, 2);
  ASSERT_TRUE(mailbox.acknowledge(1, now));
  EXPECT_EQ(wakes, 3);
  mailbox.silence();
  mailbox.close(bytes(1));
  EXPECT_EQ(wakes, 3);
}

}  // namespace
}  // namespace clothstream::stream
