// SPDX-License-Identifier: MIT
// The rate controller on simulated paths, alone and together with other flows, in simulated time.
#include "server/delivery/rate_controller.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "server/delivery/link_adaptation.h"
#include "server/delivery/packet_pacer.h"
#include "tests/serving/delivery/rival_flows.h"
#include "tests/serving/delivery/simulated_bottleneck.h"

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

constexpr double kFrameRate = 72;
constexpr double kPacket = 1150;  // bytes

Clock::time_point at(double seconds) {
  return Clock::time_point(1h) +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

// Frames through the controller and the pacer, and a client that sends receipts.
class DatagramFlow final : public Flow {
 public:
  // `frameBytes`: bytes of the next frame, without parity. Frames start up to 2 ms late, because encoders
  // take their time.
  DatagramFlow(Bottleneck& path, std::function<double(DatagramFlow&, double now)> frameBytes,
               double start = 0)
      : path_(path), frameBytes_(std::move(frameBytes)), start_(start), nextFrame_(start) {
    path.wakeAt(*this, start);
  }

  RateController controller;
  double drift = 0;  // of the client's clock, as a part of the time
  std::size_t frames = 0, skipped = 0;
  bool behind = false;  // the newest frame was skipped
  double padding = 0;   // parity that fills frames where there is room, as a part of their bytes

  void wake(double now) override {
    if (now >= nextFrame_) {
      startFrame(now);
      nextFrame_ = start_ + static_cast<double>(++ticks_) / kFrameRate + 0.002 * path_.random();
      path_.wakeAt(*this, nextFrame_);
    }
    while (const auto packet = pacer_.next(controller.pace(), controller.quantum(), at(now))) {
      controller.sent(number_, packet->bytes, at(now));
      path_.send(*this, {.number = number_++, .bytes = packet->bytes, .first = packet->first});
    }
    if (!pacer_.due()) return;
    const double due = schedule::seconds(*pacer_.due() - at(0)) + 1e-6;
    if (due != timer_) path_.wakeAt(*this, timer_ = due);
  }
  void arrive(const SimulatedPacket& packet, double now) override {
    const auto ahead = static_cast<std::int32_t>(packet.number - receipt_.newest);
    if (!any_ || ahead > 0) {
      receipt_.mask = !any_ || ahead > 64 ? 0 : (receipt_.mask << 1 | 1) << (ahead - 1);
      receipt_.newest = packet.number;
      // The clock wraps after a few seconds.
      receipt_.arrivalUs =
          static_cast<std::uint32_t>(static_cast<std::int64_t>(now * (1 + drift) * 1e6) - 5'000'000);
      any_ = true;
    } else if (ahead < 0 && ahead >= -64) {
      receipt_.mask |= std::uint64_t{1} << (-ahead - 1);
    }
    if (!packet.first && now - receiptTime_ < 0.02) return;
    receiptTime_ = now;
    path_.reply(*this, receipt_);
  }
  void report(const SimulatedReport& receipt, double now) override {
    EXPECT_TRUE(controller.received(receipt.newest, receipt.arrivalUs, receipt.mask, at(now)));
  }

 private:
  struct Packet {
    std::uint32_t bytes;
    bool first;
  };

  void add(double bytes, bool first, double now) {
    const auto size = static_cast<std::uint32_t>(bytes);
    ASSERT_TRUE(pacer_.add({size, first}, size, false, at(now)));
  }
  void startFrame(double now) {
    const double bytes = frameBytes_(*this, now);
    behind = !controller.hasRoom(pacer_.bytes(), at(now));
    ++(behind ? skipped : frames);
    if (behind) return;
    for (double left = bytes; left >= 1; left -= kPacket) add(std::min(left, kPacket), left == bytes, now);
    for (double left = padding * bytes; left >= kPacket && controller.hasRoom(pacer_.bytes(), at(now));
         left -= kPacket)
      add(kPacket, false, now);
  }

  Bottleneck& path_;
  std::function<double(DatagramFlow&, double now)> frameBytes_;
  double start_, nextFrame_, timer_ = -1;
  std::uint64_t ticks_ = 0;
  PacketPacer<Packet> pacer_;
  std::uint32_t number_ = std::numeric_limits<std::uint32_t>::max() - 1000;  // wraps soon
  SimulatedReport receipt_;
  bool any_ = false;
  double receiptTime_ = 0;
};

using FrameBytes = std::function<double(DatagramFlow&, double)>;

// Frames as large as the controller allows, up to a rate in Mbit/s.
FrameBytes upTo(double megabits) {
  return [=](DatagramFlow& flow, double) {
    return std::clamp(flow.controller.rate() / kFrameRate, 300.0, megabits * 1e6 / 8 / kFrameRate);
  };
}
FrameBytes constant(double megabits) {
  return [=](DatagramFlow&, double) { return megabits * 1e6 / 8 / kFrameRate; };
}

// Advances in steps of 1 ms until `holds` returns true. Returns the time taken, or more than the limit.
double timeUntil(Bottleneck& path, double limit, const std::function<bool()>& holds) {
  const double start = path.now();
  while (!holds() && path.now() - start <= limit) path.run(path.now() + 0.001);
  return path.now() - start;
}

void print(const char* name, const PathShape& shape, DatagramFlow& flow, double rate, double other) {
  std::printf(
      "%s, %.0f Mbit/s, buffer %.0f ms, round trip %.0f ms: %.2f and %.2f Mbit/s, "
      "queue p50 %.0f ms, p99 %.0f ms, frames skipped %.1f %%\n",
      name, shape.megabits, 1e3 * shape.buffer, 2e3 * shape.oneWay, rate, other,
      1e3 * flow.queueQuantile(0.5), 1e3 * flow.queueQuantile(0.99),
      100.0 * static_cast<double>(flow.skipped) / static_cast<double>(flow.frames + flow.skipped));
}

class AtRate : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Megabits, AtRate, testing::Values(2, 5, 20),
                         [](const auto& rate) { return std::to_string(std::lround(rate.param)); });

// A cut leaves at least 0.9 of the product, and the window then grows to more than the product: the mean is
// at least 0.9 of the rate once it has converged.
TEST_P(AtRate, AloneFillsTheLinkWithAShortQueue) {
  for (const double oneWay : {0.005, 0.025, 0.05}) {
    const PathShape shape{.megabits = GetParam(), .oneWay = oneWay};
    Bottleneck path(shape);
    auto& flow = path.add<DatagramFlow>(upTo(50));
    path.run(20);
    const double rate = flow.megabits(5, 20);
    print("alone", shape, flow, rate, 0);
    EXPECT_GE(rate, 0.9 * shape.megabits);
    EXPECT_LE(flow.queueQuantile(0.99), 0.03);
    EXPECT_FALSE(flow.controller.competes());
  }
}

// Equal flows should have half each. Differences of a packet in the base delay shift that by up to 0.15, and
// at 2 Mbit/s, where a packet takes 5 ms, by up to 0.25; the time at which the other flow begins decides. A
// packet of the other flow may be in front at any time.
TEST_P(AtRate, SharesWithItsOwnKind) {
  for (const double oneWay : {0.01, 0.025}) {
    const PathShape shape{.megabits = GetParam(), .oneWay = oneWay};
    Bottleneck path(shape);
    auto& flow = path.add<DatagramFlow>(upTo(50));
    auto& other = path.add<DatagramFlow>(upTo(50), 3.0);
    path.run(40);
    const double rate = flow.megabits(20, 40), otherRate = other.megabits(20, 40);
    print("two of a kind", shape, flow, rate, otherRate);
    EXPECT_NEAR(rate / (rate + otherRate), 0.5, shape.megabits > 2 ? 0.15 : 0.25);
    EXPECT_GE(rate + otherRate, 0.9 * shape.megabits);
    EXPECT_LE(flow.queueQuantile(0.99), 0.03 + kPacket * 8e-6 / shape.megabits);
  }
}

// Within 50 s there are only a few losses, and each lets one of the flows have more for seconds.
TEST_P(AtRate, SharesWithCubic) {
  for (const double buffer : {0.05, 0.1}) {
    const PathShape shape{.megabits = GetParam(), .buffer = buffer};
    Bottleneck path(shape);
    auto& flow = path.add<DatagramFlow>(upTo(50));
    auto& cubic = path.add<CubicFlow>(3.0);
    path.run(50);
    const double rate = flow.megabits(15, 50), otherRate = cubic.megabits(15, 50);
    print("with CUBIC", shape, flow, rate, otherRate);
    EXPECT_NEAR(rate / (rate + otherRate), 0.5, 0.2);
  }
}

// BBR probes at random times. The queue is that of both.
TEST_P(AtRate, SharesWithBbrInALargeBuffer) {
  const PathShape shape{.megabits = GetParam(), .buffer = 0.2};
  Bottleneck path(shape);
  auto& flow = path.add<DatagramFlow>(upTo(50));
  auto& bbr = path.add<BbrFlow>(3.0);
  path.run(50);
  const double rate = flow.megabits(15, 50), otherRate = bbr.megabits(15, 50);
  print("with BBR", shape, flow, rate, otherRate);
  EXPECT_NEAR(rate / (rate + otherRate), 0.5, 0.3);
}

// BBR version 1 ignores loss and takes most of a link with a buffer of at most one bandwidth-delay product.
// CUBIC gets little, too.
TEST(RateController, BbrInASmallBufferLeavesLittle) {
  const PathShape shape{.megabits = 10, .buffer = 0.05};
  Bottleneck path(shape), reference(shape);
  auto& flow = path.add<DatagramFlow>(upTo(50));
  auto& bbr = path.add<BbrFlow>(3.0);
  auto& cubic = reference.add<CubicFlow>();
  reference.add<BbrFlow>(3.0);
  path.run(50);
  reference.run(50);
  const double rate = flow.megabits(15, 50);
  print("with BBR", shape, flow, rate, bbr.megabits(15, 50));
  std::printf("CUBIC gets %.2f Mbit/s there\n", cubic.megabits(15, 50));
  EXPECT_GE(rate, cubic.megabits(15, 50) / 3);
}

TEST(RateController, SharesWithCubicUnderCodel) {
  const PathShape shape{.megabits = 10, .codel = true};
  Bottleneck path(shape);
  auto& flow = path.add<DatagramFlow>(upTo(50));
  auto& cubic = path.add<CubicFlow>(3.0);
  path.run(30);
  const double rate = flow.megabits(10, 30), otherRate = cubic.megabits(10, 30);
  print("with CUBIC, CoDel", shape, flow, rate, otherRate);
  EXPECT_NEAR(rate / (rate + otherRate), 0.5, 0.2);
}

TEST(RateController, ShortQueueReturnsAfterCubic) {
  const PathShape shape{.megabits = 10};
  Bottleneck path(shape);
  auto& flow = path.add<DatagramFlow>(upTo(50));
  path.add<CubicFlow>(3.0).end = 13;
  path.run(13);
  EXPECT_TRUE(flow.controller.competes());
  // The next test is at most kLongestTest away, and a test takes less than a second.
  const double taken = timeUntil(path, 17, [&] { return !flow.controller.competes(); });
  std::printf("CUBIC has ended: yields again after %.1f s\n", taken);
  EXPECT_LE(taken, 17);
  flow.queueDelays.clear();
  path.run(path.now() + 10);
  EXPECT_LE(flow.queueQuantile(0.99), 0.03);
}

struct Radio {
  const char* name;
  double loss, burst, jitter;
};

// The stream uses half of the link. Two frames in 100 may wait for a frame more.
TEST(RateController, RadioLossTakesNoFrames) {
  for (const Radio& radio : {Radio{"5 % loss", 0.05, 1, 0}, Radio{"2 % in bursts of 4", 0.02, 4, 0},
                             Radio{"5 % loss, jitter", 0.05, 1, 0.02}, Radio{"10 % loss", 0.1, 1, 0},
                             Radio{"jitter", 0, 1, 0.02}}) {
    const PathShape shape{.megabits = 10, .jitter = radio.jitter, .loss = radio.loss, .burst = radio.burst};
    Bottleneck path(shape);
    auto& flow = path.add<DatagramFlow>(constant(5));
    path.run(5);
    flow.frames = flow.skipped = 0;
    path.run(25);
    print(radio.name, shape, flow, flow.megabits(5, 25), 0);
    EXPECT_LE(flow.skipped, flow.frames / 50) << radio.name;
    // Standard deviation of the share over the packets of the meter, times 4.
    const double tolerance = 4 * std::sqrt(radio.loss * (2 * radio.burst - 1) / LossMeter::kPackets);
    EXPECT_NEAR(flow.controller.loss().share(), radio.loss, tolerance + 0.005) << radio.name;
    EXPECT_EQ(flow.controller.loss().burst() > 1.5, radio.burst > 1) << radio.name;
  }
}

// A processor or a radio that stops for two frames now and then makes no queue that stands. Losses that come
// at the same time are no congestion.
TEST(RateController, StallsWithRadioLossTakeNoFrames) {
  const PathShape shape{.megabits = 100, .loss = 0.05, .stall = 0.03};
  Bottleneck path(shape);
  auto& flow = path.add<DatagramFlow>(constant(2));
  path.run(5);
  flow.frames = flow.skipped = 0;
  path.run(205);
  print("5 % loss, stalls of 30 ms", shape, flow, flow.megabits(5, 205), 0);
  EXPECT_LE(flow.skipped, flow.frames / 500);
}

// Buffers that are larger and smaller than the delay target, and a policer, which has hardly any. The rate
// falls by a third or more at once, within two round trips and the time until a receipt.
TEST(RateController, AnswersTailDropWithinTwoRoundTrips) {
  for (const double buffer : {0.1, 0.02, 0.004}) {
    const PathShape shape{.megabits = 10, .buffer = buffer};
    Bottleneck path(shape);
    auto& flow = path.add<DatagramFlow>(upTo(8));
    path.run(10);
    flow.dropped = 0;
    path.shape.megabits = 4;
    timeUntil(path, 1, [&] { return flow.dropped > 0; });
    const double roundTrip = 2 * shape.oneWay + buffer * shape.megabits / path.shape.megabits;
    const double answer = timeUntil(path, 1, [&] { return flow.controller.rate() < 0.7 * 8e6 / 8; });
    std::printf("8 to 4 Mbit/s, buffer %.0f ms: rate below 5.6 after %.0f ms, round trip %.0f ms\n",
                1e3 * buffer, 1e3 * answer, 1e3 * roundTrip);
    EXPECT_LE(answer, 2.25 * roundTrip + 0.02) << buffer;
  }
}

TEST(RateController, ClimbsBackWithinTwoSeconds) {
  for (const double oneWay : {0.005, 0.025, 0.05}) {
    Bottleneck path({.megabits = 10, .oneWay = oneWay});
    auto& flow = path.add<DatagramFlow>(upTo(50));
    path.run(10);
    path.shape.megabits = 3;
    path.run(20);
    EXPECT_NEAR(flow.megabits(15, 20), 2.85, 0.15);
    path.shape.megabits = 10;
    path.run(22);
    path.run(23);
    std::printf("3 to 10 Mbit/s, round trip %.0f ms: %.1f %.1f %.1f %.1f %.1f %.1f Mbit/s in half seconds\n",
                2e3 * oneWay, flow.megabits(20, 20.5), flow.megabits(20.5, 21), flow.megabits(21, 21.5),
                flow.megabits(21.5, 22), flow.megabits(22, 22.5), flow.megabits(22.5, 23));
    EXPECT_GE(flow.megabits(21.5, 22), 8.5);
  }
}

TEST(RateController, FollowsALongerRoute) {
  Bottleneck path({.megabits = 10});
  auto& flow = path.add<DatagramFlow>(upTo(50));
  path.run(10);
  path.shape.oneWay = 0.045;
  path.run(50);
  std::printf("route longer by 20 ms: %.1f Mbit/s in the first 5 s, %.1f later\n", flow.megabits(10, 15),
              flow.megabits(45, 50));
  EXPECT_GE(flow.megabits(10, 15), 5);
  EXPECT_GE(flow.megabits(45, 50), 9);
  EXPECT_NEAR(flow.controller.minimumRoundTrip(), 0.09, 0.01);
}

TEST(RateController, FollowsADriftingClock) {
  for (const double drift : {-1e-4, 1e-4}) {
    Bottleneck path({.megabits = 5});
    auto& flow = path.add<DatagramFlow>(upTo(50));
    flow.drift = drift;
    path.run(60);
    EXPECT_GE(flow.megabits(40, 60), 0.9 * 5);
    EXPECT_LE(flow.queueQuantile(0.99), 0.033) << "30 s of drift";
  }
}

TEST(RateController, GoesOnAfterAStall) {
  Bottleneck path({.megabits = 10});
  auto& flow = path.add<DatagramFlow>(constant(4));
  path.run(5);
  path.shape.loss = 1;
  path.run(5.4);
  path.shape.loss = 0;
  EXPECT_FALSE(flow.controller.silent(at(path.now())));
  const double taken = timeUntil(path, 2, [&] { return flow.controller.rate() > 4e6 / 8; });
  std::printf("stall of 400 ms: rate is back after %.0f ms\n", 1e3 * taken);
  EXPECT_LE(taken, 1);
}

TEST(RateController, GrowthNeedsUse) {
  Bottleneck path({.megabits = 20});
  auto& flow = path.add<DatagramFlow>(constant(2));
  path.run(20);
  // 1.5 times the bytes in flight, which are those of a round trip, of the time until the receipt and of a
  // frame more.
  const double inFlight = 2 * (0.05 + 0.02 + 1 / kFrameRate);
  EXPECT_LE(flow.controller.rate() * 8e-6, 1.5 * inFlight / (0.05 + 0.02) + 0.1);
  EXPECT_GE(flow.controller.rate() * 8e-6, 2);
}

TEST(RateController, NoticesASilentPath) {
  Bottleneck path({.megabits = 10});
  auto& flow = path.add<DatagramFlow>(constant(4));
  EXPECT_FALSE(flow.controller.silent(at(0)));
  path.run(5);
  path.shape.loss = 1;
  path.run(5.4);
  EXPECT_FALSE(flow.controller.silent(at(path.now())));
  path.run(5.7);
  EXPECT_TRUE(flow.controller.silent(at(path.now())));
  path.shape.loss = 0;
  // Packets that were sent before have left the window by then.
  path.run(6.3);
  EXPECT_FALSE(flow.controller.silent(at(path.now())));
}

TEST(RateController, PauseIsNoSilence) {
  RateController controller;
  controller.sent(0, 1000, at(0));
  controller.sent(1, 1000, at(0.005));
  ASSERT_TRUE(controller.received(0, 0, 0, at(0.05)));
  EXPECT_FALSE(controller.silent(at(10))) << "the last packet before the pause was lost";
  controller.sent(2, 1000, at(10));
  EXPECT_FALSE(controller.silent(at(10.4)));
  EXPECT_TRUE(controller.silent(at(10.5)));
}

// The controller and LinkAdaptation together choose one of four qualities of a stream of 8 Mbit/s.
TEST(RateController, QualityFollowsTheLink) {
  Bottleneck path({.megabits = 10});
  LinkAdaptation adaptation(0, 3);
  auto& flow = path.add<DatagramFlow>([&](DatagramFlow& self, double now) {
    const double bytes = 8e6 / 8 / kFrameRate * std::pow(LinkAdaptation::kCoarserRate, adaptation.quality());
    adaptation.made(adaptation.quality(), static_cast<std::size_t>(bytes), at(now));
    adaptation.update(self.behind, at(now), self.controller.rate());
    self.padding = adaptation.wantsFiner() ? LinkAdaptation::kProbe - 1 : 0;
    return bytes;
  });
  path.run(5);
  EXPECT_EQ(adaptation.quality(), 0);
  path.shape.megabits = 4;
  const double down = timeUntil(path, 2, [&] { return adaptation.quality() >= 2; });
  EXPECT_LE(down, 1);
  path.run(15);
  flow.queueDelays.clear();
  path.run(25);
  EXPECT_GE(adaptation.quality(), 2);
  // A frame with its padding takes up to 20 ms of this link.
  EXPECT_LE(flow.queueQuantile(0.99), 0.04);
  path.shape.megabits = 10;
  const double up = timeUntil(path, 4, [&] { return adaptation.quality() == 0; });
  std::printf("8 Mbit/s stream, link of 4 Mbit/s: down in %.1f s, up again in %.1f s\n", down, up);
  EXPECT_LE(up, 3);
}

TEST(RateController, RefusesReceiptsOfUnsentPackets) {
  RateController controller;
  EXPECT_FALSE(controller.received(0, 0, 0, at(0)));
  controller.sent(7, 1000, at(0));
  EXPECT_FALSE(controller.received(8, 0, 0, at(0.1)));
  EXPECT_FALSE(controller.received(0x7fffffffu, 0, 0, at(0.1)));
  EXPECT_TRUE(controller.received(7, 0, ~std::uint64_t{0}, at(0.1)));
  EXPECT_TRUE(controller.received(7, 5, 0, at(0.2))) << "repeated";
  EXPECT_TRUE(controller.received(3, 5, 0, at(0.2))) << "may be late";
}

// A hostile client reports any arrival times. It can only harm its own stream.
TEST(RateController, AnyArrivalTimesKeepTheRateInBounds) {
  std::minstd_rand random(1);
  RateController controller;
  double now = 0;
  for (std::uint32_t number = 0; number < 20'000; ++number) {
    controller.sent(number, 1000, at(now));
    now += 0.001;
    const auto newest = number - static_cast<std::uint32_t>(random() % 80);
    ASSERT_TRUE(controller.received(newest, static_cast<std::uint32_t>(4 * random()), random(), at(now)));
    ASSERT_GT(controller.rate(), 0);
    ASSERT_LT(controller.rate(), 1e9);
    ASSERT_TRUE(std::isfinite(controller.pace()));
  }
}

}  // namespace
}  // namespace clothstream::delivery
