// SPDX-License-Identifier: MIT
// Frames of one peer by datagrams, by the stream after silence, and back. Time is simulated.
#include "server/endpoint/datagram/frame_link.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/datagram/frame_assembly.h"
#include "proto/datagram/piece.h"
#include "server/delivery/mailbox.h"

namespace clothstream::endpoint {
namespace {

using namespace std::chrono_literals;
using delivery::PublishedFrame;
using Bytes = std::vector<std::byte>;

constexpr auto kDelay = 10ms;  // of each direction
constexpr auto kInterval = 14ms;
constexpr std::uint32_t kHeaders = 85;

// A scene with one subscriber, whose datagrams travel over a link with a delay. The subscriber acknowledges
// each frame, and fails the test if it gets one twice or out of order.
class FrameLinkTest : public ::testing::Test {
 protected:
  FrameLinkTest() { mailbox->subscribe(nullptr, {.rate = 72}, scene); }

  void pass(Clock::duration time) {
    for (const Clock::time_point end = now + time; now < end;) {
      now += 1ms;
      if (now >= nextFrame) publish();
      link.advance(open, now, [this](std::span<const std::byte> payload, bool) {
        if (carries(random))
          at(kDelay, [this, bytes = Bytes(payload.begin(), payload.end())] { arrive(bytes); });
      });
      for (; !events.empty() && events.begin()->first <= now; events.erase(events.begin()))
        events.begin()->second();
      while (const auto message = mailbox->next(now))
        at(kDelay, [this, message] { take(*message, byStream); });
      report();
    }
  }
  void publish() {
    nextFrame = now + kInterval;
    const bool key = tick == 0 || mailbox->requested(now).keyFrames != 0;
    Bytes message(frameBytes);
    for (std::byte& byte : message) byte = static_cast<std::byte>(random());
    published.push_back(std::make_shared<const Bytes>(std::move(message)));
    ++tick;
    mailbox->deliver(PublishedFrame{
        .message = published.back(), .tick = tick, .key = key, .referenceTick = tick - 1, .complete = now});
  }
  void take(const delivery::SharedBytes& message, std::size_t& count) {
    const auto found = std::ranges::find_if(published, [&](const auto& each) { return *each == *message; });
    ASSERT_NE(found, published.end()) << "the frame has other bytes";
    const auto taken = static_cast<std::uint64_t>(found - published.begin()) + 1;
    // Frames of two ways can overtake one another.
    ASSERT_TRUE(seen.insert(taken).second) << "the frame came before";
    ++count;
    at(kDelay, [this, taken] { EXPECT_TRUE(mailbox->acknowledge(taken, now)); });
  }
  void arrive(const Bytes& datagram) {
    const auto piece = datagram::parsePiece(datagram);
    ASSERT_TRUE(piece);
    received.add(piece->prefix.packet, us());
    assembly.add(*piece, us());
  }
  // Client's side: frames, receipts and requests.
  void report() {
    while (const auto frame = assembly.next(us()))
      take(std::make_shared<const Bytes>(frame->message.begin(), frame->message.end()), byLink);
    std::array<std::byte, datagram::kMaxDatagramBytes> out;
    while (const auto request = assembly.nextRequest(us()))
      answer(out, datagram::writeRequest(*request, out));
    if (received.dueUs().value_or(us()) > us()) return;
    if (const auto receipt = received.take()) answer(out, datagram::writeReceipt(*receipt, out));
  }
  void answer(std::span<const std::byte> out, std::size_t size) {
    if (carries(random))
      at(kDelay, [this, bytes = Bytes(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size))] {
        link.receive(bytes, now);
      });
  }
  void at(Clock::duration delay, std::function<void()> action) {
    events.emplace(now + delay, std::move(action));
  }
  std::uint64_t us() const { return schedule::microseconds(now); }

  telemetry::SceneMetrics scene;
  telemetry::DatagramMetrics metrics;
  Clock::time_point now{1h}, nextFrame = now;
  const std::shared_ptr<delivery::Mailbox> mailbox = std::make_shared<delivery::Mailbox>([] {});
  SharedPieces pieces;
  std::vector<Bytes> inputs;
  FrameLink link{{.name = "peer",
                  .reached = {},
                  .offer = {},
                  .outlet = mailbox,
                  .receive = [this](auto message) { inputs.emplace_back(message.begin(), message.end()); }},
                 [] {},
                 kHeaders,
                 pieces,
                 metrics};
  bool open = true;
  std::bernoulli_distribution carries{1};
  std::mt19937 random{1};
  std::size_t frameBytes = 5000;
  std::vector<delivery::SharedBytes> published;
  std::uint64_t tick = 0;
  std::set<std::uint64_t> seen;
  std::size_t byStream = 0, byLink = 0;

 private:
  std::multimap<Clock::time_point, std::function<void()>> events;
  datagram::FrameAssembly assembly;
  datagram::ReceivedPackets received;
};

TEST_F(FrameLinkTest, FramesLeaveByDatagrams) {
  pass(1s);
  EXPECT_EQ(metrics.peers, 1u);
  EXPECT_LE(byStream, 3u) << "before the first acknowledgement";
  EXPECT_GE(byLink, 65u);
  EXPECT_EQ(scene.datagramFrames.value() + byStream, scene.framesTaken.value());
  EXPECT_EQ(metrics.repeats.value(), 0u);
}

TEST_F(FrameLinkTest, RepairsLoss) {
  carries = std::bernoulli_distribution(0.9);
  pass(2s);
  EXPECT_GE(byLink + byStream, 125u);
  EXPECT_GT(metrics.lost.value(), 30u);
}

TEST_F(FrameLinkTest, RepeatsFrameOnRequest) {
  pass(300ms);
  carries = std::bernoulli_distribution(0);
  pass(kInterval);
  carries = std::bernoulli_distribution(1);
  pass(300ms);
  EXPECT_GT(metrics.repeats.value(), 0u);
  EXPECT_GE(seen.size() + 4, tick) << "no frame is lost but those on their way";
}

TEST_F(FrameLinkTest, SilenceReturnsFramesToStream) {
  pass(500ms);
  const std::size_t before = byStream;
  carries = std::bernoulli_distribution(0);
  pass(480ms);
  EXPECT_EQ(byStream, before);
  pass(500ms);
  EXPECT_EQ(metrics.fallbacks.value(), 1u);
  EXPECT_EQ(metrics.peers, 0u);
  EXPECT_GT(byStream, before + 10);
}

TEST_F(FrameLinkTest, FramesReturnWhenProbeArrives) {
  pass(300ms);
  carries = std::bernoulli_distribution(0);
  pass(1s);
  ASSERT_EQ(metrics.fallbacks.value(), 1u);
  const std::uint64_t packets = metrics.packets.value();
  pass(5s);
  EXPECT_EQ(metrics.packets.value(), packets + 1) << "after 2 s, and then not before 6 s";
  carries = std::bernoulli_distribution(1);
  const std::size_t before = byLink;
  pass(1s);
  EXPECT_EQ(metrics.peers, 1u);
  EXPECT_GT(byLink, before);
  EXPECT_EQ(metrics.fallbacks.value(), 1u);
}

// Packets on the old path fill the window.
TEST_F(FrameLinkTest, FramesGoOnAtNewAddress) {
  pass(300ms);
  carries = std::bernoulli_distribution(0);
  pass(300ms);
  carries = std::bernoulli_distribution(1);
  const std::size_t before = byLink;
  link.peerMoved(now);
  pass(150ms);
  EXPECT_GT(byLink, before);
  pass(1s);
  EXPECT_EQ(metrics.fallbacks.value(), 0u);
}

TEST_F(FrameLinkTest, NewAddressIsProbedAtOnce) {
  pass(300ms);
  carries = std::bernoulli_distribution(0);
  pass(700ms);
  ASSERT_EQ(metrics.fallbacks.value(), 1u);
  carries = std::bernoulli_distribution(1);
  link.peerMoved(now);
  pass(100ms);
  EXPECT_EQ(metrics.peers, 1u);
}

TEST_F(FrameLinkTest, ClosedPathReturnsFramesToStream) {
  pass(300ms);
  const std::size_t before = byStream;
  open = false;
  pass(300ms);
  EXPECT_GT(byStream, before + 15);
  EXPECT_EQ(metrics.peers, 0u);
}

TEST_F(FrameLinkTest, ClosedPathHasNothingDue) {
  pass(300ms);
  carries = std::bernoulli_distribution(0);
  for (int i = 0; i < 1000 && metrics.fallbacks.value() == 0; ++i) pass(1ms);
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  const auto frames = static_cast<std::uint32_t>(scene.datagramFrames.value());
  link.receive(std::span(out).first(datagram::writeRequest({.frame = frames - 1, .present = {}}, out)), now);
  ASSERT_GT(metrics.repeats.value(), 0u);
  open = false;
  pass(1ms);
  EXPECT_EQ(link.nextTime(), Clock::time_point::max());
}

TEST_F(FrameLinkTest, InputIsTakenOnce) {
  datagram::InputSender sender;
  const Bytes message(3, std::byte{7});
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  link.receive(std::span(out).first(sender.write(message, us(), out)), now);
  link.receive(std::span(out).first(sender.repeat(us(), out)), now);
  EXPECT_EQ(inputs, (std::vector<Bytes>{message}));
}

TEST_F(FrameLinkTest, IgnoresForeignPayloads) {
  pass(100ms);
  for (int kind = 0; kind < 256; ++kind) link.receive(Bytes(9, static_cast<std::byte>(kind)), now);
  link.receive({}, now);
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  link.receive(std::span(out).first(datagram::writeReceipt({.newest = 1'000'000}, out)), now);
  pass(100ms);
  EXPECT_EQ(metrics.peers, 1u);
}

TEST(FrameSenderTest, ProbeFillsFrameWhereThereIsRoom) {
  const Clock::time_point now{1h};
  FrameSender sender(kHeaders);
  EXPECT_EQ(sender.rowsFor(4500, false, now), 1u);
  EXPECT_EQ(sender.rowsFor(4500, true, now), 2u) << "4 data pieces are filled up to 1.59 times their size";
  SharedPieces pieces;
  sender.add(pieces.of(std::make_shared<const Bytes>(12'000), 0), 0, now);
  EXPECT_EQ(sender.rowsFor(4500, true, now), 1u);
}

// Indices of the pieces that leave until `until`, with the number of their frame.
std::vector<std::pair<std::uint32_t, unsigned>> piecesUntil(FrameSender& sender, Clock::time_point& now,
                                                            Clock::time_point until) {
  std::vector<std::pair<std::uint32_t, unsigned>> left;
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  for (; now < until; now += 1ms)
    while (const std::size_t size = sender.next(now, out)) {
      const std::optional<datagram::Piece> piece = datagram::parsePiece(std::span(out).first(size));
      if (piece) left.emplace_back(piece->prefix.frame, piece->index);
    }
  return left;
}

// A receipt says that four packets in a row were lost.
TEST(FrameSenderTest, DefersParityInBursts) {
  Clock::time_point now{1h};
  FrameSender sender(kHeaders);
  SharedPieces pieces;
  const auto frame = pieces.of(std::make_shared<const Bytes>(1500), 4);
  for (int i = 0; i < 10; ++i) {
    sender.add(frame, 2, now);
    EXPECT_EQ(piecesUntil(sender, now, now + 13ms).size(), 4u);
  }
  // Packets 16 to 19 of 0 to 39 are lost.
  ASSERT_TRUE(sender.acknowledge({.newest = 39, .before = ~(std::uint64_t{0xf} << 19)}, now));
  using Left = std::vector<std::pair<std::uint32_t, unsigned>>;
  sender.add(frame, 1, now);
  EXPECT_EQ(piecesUntil(sender, now, now + 13ms), (Left{{10, 0}, {10, 1}}));
  sender.add(frame, 1, now);
  EXPECT_EQ(piecesUntil(sender, now, now + 13ms), (Left{{11, 0}, {11, 1}, {10, 2}}));
  EXPECT_EQ(piecesUntil(sender, now, now + 30ms), (Left{{11, 2}})) << "no other frame has followed";
  EXPECT_FALSE(sender.due());
}

// Peers of a scene share the pieces of a frame.
TEST(SharedPiecesTest, MakesPiecesOnce) {
  SharedPieces pieces;
  const auto message = std::make_shared<const Bytes>(3000);
  const auto two = pieces.of(message, 2);
  EXPECT_EQ(pieces.of(message, 1), two);
  const auto three = pieces.of(message, 3);
  EXPECT_EQ(three->pieces(), three->dataPieces() + 4) << "twice as many as before";
  EXPECT_EQ(pieces.of(message, 2), three);
  EXPECT_NE(pieces.of(std::make_shared<const Bytes>(3000), 2), three);
}

}  // namespace
}  // namespace clothstream::endpoint
