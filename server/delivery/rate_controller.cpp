// SPDX-License-Identifier: MIT
#include "server/delivery/rate_controller.h"

#include <algorithm>
#include <cmath>

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

constexpr double kSegment = 1150;                         // bytes; a full packet
constexpr double kFirst = 10 * kSegment;                  // RFC 6928
constexpr double kLeast = 3000, kMost = 4 * 1024 * 1024;  // bytes; kLeast: MIN_REF_WND of SCReAMv2
constexpr double kReceiptInterval = 0.02;                 // s
constexpr double kGrowth = 0.15;
// Round trip at which the window grows with kGrowth. With shorter ones it grows less, so that the rate grows
// equally (SCReAMv2, VIRTUAL_RTT); with longer ones up to kMostScale times as much.
constexpr double kScaleTime = 0.05, kMostScale = 1.75;
constexpr double kHeadroom = 1.5;  // BYTES_IN_FLIGHT_HEAD_ROOM of SCReAMv2

// Part of the bandwidth-delay product that a cut leaves.
constexpr double kLeft = 0.9;
// Queue delay up to which a queue counts as empty, s, or one packet at the rate of arrival.
constexpr double kEmpty = 0.008;
constexpr int kPatience = 4;
constexpr auto kShortestRound = 60ms;  // has at least four frames of 72 in a second

// RFC 8698, section 4.3: GAMMA_MAX, QBOUND, QEPS, LOGWIN.
constexpr double kMostRamp = 0.5, kRampQueue = 0.02, kRampEmpty = 0.005, kQuiet = 0.5;
// The ramp leaves out windows that differ from the product at the newest cut by less than this part.
constexpr double kNearby = 0.15;

// Age from which a queue is no stall of the path or of a processor.
constexpr auto kStanding = 20ms;
// Standard deviations by which a loss exceeds kRadioLoss. Every receipt is a test.
constexpr double kDeviations = 4;

constexpr auto kFrameTime = 20ms;  // at most, of a frame's packets and of a pause between frames

constexpr auto kShortestTest = 4s, kLongestTest = 16s;  // multiples of each other
constexpr auto kCalm = 1s;

// Share of a round's packets, once there are enough for an estimate.
template <typename Round>
double lossOf(const Round& round) {
  return round.settled < 8 ? 0 : static_cast<double>(round.lost) / round.settled;
}

bool isBefore(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) < 0;
}

}  // namespace

RateController::RateController() : window_(kFirst) {}

double RateController::controlTime() const {
  return minimumRoundTrip() + kReceiptInterval;
}

bool RateController::isQueued() const {
  return delay_.filtered() > kTarget / 2 + delay_.jitter();
}

bool RateController::queueStands(Clock::time_point now) const {
  return queuedSince_ && now - *queuedSince_ >= kStanding;
}

bool RateController::awaitsSeveral() const {
  return !answered_ || sent_ - *answered_ >= kFrameTime;
}

void RateController::sent(std::uint32_t number, std::uint32_t bytes, Clock::time_point now) {
  if (!awaited_ && !answered_) round_.end = number;  // the first packet
  packets_.add(number, bytes, now);
  round_.flight = std::max(round_.flight, static_cast<double>(packets_.inFlight()));
  if (!awaited_ || !awaitsSeveral()) awaited_ = now;
  sent_ = now;
}

bool RateController::hasRoom(std::uint64_t waiting, Clock::time_point now) {
  if (packets_.expire(now) && silent(now)) {
    // The path may be another one now.
    window_ = std::min(window_, kFirst);
    beforeCuts_ = 0;
    cut_.reset();
    competition_.reset();
  }
  return static_cast<double>(packets_.inFlight() + waiting) < window_;
}

bool RateController::received(std::uint32_t newest, std::uint32_t arrivalUs, std::uint64_t mask,
                              Clock::time_point now) {
  // RFC 8985, section 6.2: a quarter of the round trip, or what the jitter needs, but at most a round trip.
  const double reordering =
      std::min(std::max(6 * delay_.jitter(), minimumRoundTrip() / 4), std::max(smoothedRoundTrip(), 0.01));
  const auto report = packets_.receive(
      newest, arrivalUs, mask,
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(reordering)));
  if (!report) return false;
  if (awaited_) awaited_ = now;
  if (!report->newest) return true;
  answered_ = report->newest->sent;
  if (newest + 1 == packets_.next()) awaited_.reset();
  const double passed = receipt_ ? schedule::seconds(now - *receipt_) : 0;
  receipt_ = now;
  measure(*report, arrivalUs, now);

  if (cut_)
    judgeCut(newest, now);
  else if (competition_)
    compete(*report, passed, now);
  else
    yield(*report, now);

  if (!isBefore(newest, round_.end)) {
    before_ = round_;
    round_ = {.end = packets_.next(), .flight = static_cast<double>(packets_.inFlight())};
  }
  return true;
}

void RateController::measure(const SentPackets::Report& report, std::uint32_t arrivalUs,
                             Clock::time_point now) {
  const SentPackets::Packet& packet = *report.newest;
  const auto roundTrip = now - packet.sent;
  shortest_.add(std::chrono::duration_cast<std::chrono::microseconds>(roundTrip).count(), now);
  const double sample = schedule::seconds(roundTrip);
  roundTrip_ = roundTrip_ ? *roundTrip_ + (sample - *roundTrip_) / 8 : sample;
  delay_.add(packet.sent, arrivalUs, now);
  if (isQueued()) {
    queued_ = now;
    if (!queuedSince_) queuedSince_ = now;
  } else {
    queuedSince_.reset();
  }
  round_.settled += report.packets;
  round_.lost += report.lost;

  if (!packet.arrivalUsBefore) return;
  const auto elapsedUs = static_cast<std::int32_t>(arrivalUs - *packet.arrivalUsBefore);
  if (elapsedUs < 1000) return;
  const double rate = 1e6 * static_cast<double>(packets_.arrived() - packet.arrivedBefore) / elapsedUs;
  delivery_ = delivery_ > 0 ? delivery_ + (rate - delivery_) / 2 : rate;
}

void RateController::yield(const SentPackets::Report& report, Clock::time_point now) {
  const double queue = delay_.filtered();
  if (queue > kTarget + delay_.jitter() || (report.lost > 0 && queueStands(now))) {
    // Radio loss takes nothing from the rate that the bottleneck carries.
    const double carried = delivery_ / (1 - std::min(loss().share(), kRadioLoss));
    const double time = controlTime();
    cut(std::min(carried * time, window_ * time / (time + queue)));
  } else if (exceedsRadioLoss()) {
    // The loss may have begun in this round.
    cut(used() * (1 - std::max(lossOf(round_), lossOf(before_))));
  } else {
    grow(report.bytes, now);
  }
}

bool RateController::exceedsRadioLoss() const {
  const double settled = before_.settled + round_.settled, lost = before_.lost + round_.lost;
  // Bursts of mean length b multiply the variance of the binomial distribution by 2 b - 1.
  const double variance = settled * kRadioLoss * (1 - kRadioLoss) * (2 * loss().burst() - 1);
  return lost > settled * kRadioLoss + kDeviations * std::sqrt(variance);
}

double RateController::used() const {
  return std::min(window_, std::max(round_.flight, before_.flight));
}

bool RateController::mayGrow() const {
  return window_ < std::min(kMost, kHeadroom * std::max(round_.flight, before_.flight));
}

void RateController::grow(double bytes, Clock::time_point now) {
  if (!mayGrow()) return;
  const double time = controlTime();
  double step = kGrowth * std::sqrt(kSegment * window_) * std::min(time / kScaleTime, kMostScale);
  const bool quiet = delay_.filtered() < kRampEmpty + delay_.jitter() &&
                     schedule::seconds(now - queued_) > std::max(kQuiet, 4 * time);
  if (quiet && std::abs(window_ - lastProduct_) > kNearby * lastProduct_)
    step = std::max(step, window_ * std::min(kMostRamp, kRampQueue / (time + QueueDelay::kRise)));
  window_ += step * bytes / window_;
}

void RateController::reduce(double product) {
  lastProduct_ = product;
  // At most half of what was in use goes at once, because a measured rate may be that of a stall.
  window_ = std::clamp(kLeft * product, std::max(used() / 2, kLeast), std::max(window_, kLeast));
}

void RateController::cut(double product) {
  if (beforeCuts_ == 0) beforeCuts_ = window_;
  cut_ = Cut{.begin = packets_.next()};
  reduce(product);
  round_ = before_ = {.end = packets_.next(), .flight = static_cast<double>(packets_.inFlight())};
}

void RateController::judgeCut(std::uint32_t newest, Clock::time_point now) {
  if (isBefore(newest, cut_->begin)) return;
  const auto beginRound = [&] {
    cut_->round = {.end = packets_.next()};
    cut_->roundBegin = now;
    cut_->shortestQueue = delay_.newest();
  };
  if (!cut_->round) return beginRound();
  cut_->shortestQueue = std::min(cut_->shortestQueue, delay_.newest());
  if (isBefore(newest, cut_->round->end) || now - cut_->roundBegin < kShortestRound) return;

  const double packet = delivery_ > 0 ? kSegment / delivery_ : 0;
  if (cut_->shortestQueue < std::clamp(packet, kEmpty, kTarget)) {
    cut_.reset();
    competition_.reset();
    beforeCuts_ = 0;
  } else if (competition_ || ++cut_->unanswered == kPatience) {
    cut_.reset();
    beginCompetition(now);
  } else {
    if (delay_.filtered() > 2 * kTarget) reduce(delivery_ * controlTime());
    beginRound();
  }
}

void RateController::beginCompetition(Clock::time_point now) {
  if (competition_)
    competition_->interval = std::min<Clock::duration>(2 * competition_->interval, kLongestTest);
  else
    competition_ = {
        .window = CubicWindow(beforeCuts_), .interval = kShortestTest, .reduced = packets_.next()};
  competition_->queued = now;
  // At least half an interval from now.
  const Clock::duration earliest = now.time_since_epoch() + competition_->interval / 2;
  competition_->test =
      Clock::time_point(earliest - earliest % competition_->interval + competition_->interval);
  beforeCuts_ = 0;
  window_ = competition_->window.window();
}

void RateController::compete(const SentPackets::Report& report, double passed, Clock::time_point now) {
  Competition& competition = *competition_;
  if (delay_.filtered() > kTarget) competition.queued = now;
  if (now - competition.queued > kCalm) {
    competition_.reset();
  } else if (now >= competition.test) {
    const double time = controlTime();
    cut(std::min(delivery_ * time, window_ * time / (time + delay_.filtered())));
  } else {
    if (report.lost > 0 && queueStands(now) && !isBefore(report.newestLost, competition.reduced)) {
      competition.window.reduce();
      competition.reduced = packets_.next();
    } else if (mayGrow()) {
      competition.window.acknowledge(report.bytes, passed, smoothedRoundTrip());
    }
    window_ = competition.window.window();
  }
}

}  // namespace clothstream::delivery
