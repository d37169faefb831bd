// SPDX-License-Identifier: MIT
// Models of TCP flows that always have data: CUBIC and BBR. Every packet is acknowledged by itself; lost data
// goes into new packets, so that only the numbers of packets count.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>

#include "tests/serving/delivery/simulated_bottleneck.h"

namespace clothstream::delivery {

// Base of both models: packets under way, acknowledgements, detection of losses by three later packets
// (RFC 9002, section 6.1.1) or a timeout.
class RivalFlow : public Flow {
 public:
  static constexpr std::uint32_t kBytes = 1448;

  explicit RivalFlow(Bottleneck& path, double start = 0) : path_(path) { path.wakeAt(*this, start); }

  double end = std::numeric_limits<double>::max();  // sends nothing later

  void arrive(const SimulatedPacket& packet, double) override {
    path_.reply(*this, {.newest = packet.number});
  }
  void report(const SimulatedReport& report, double now) override {
    const std::uint32_t place = report.newest - first_;
    if (place >= sent_.size() || sent_[place].done) return;
    Sent& acknowledged = sent_[place];
    acknowledged.done = true;
    --flying_;
    ++deliveredPackets_;
    deliveredTime_ = now;
    const double sample = now - acknowledged.time;
    roundTrip_ = roundTrip_ > 0 ? roundTrip_ + (sample - roundTrip_) / 8 : sample;
    const Acknowledged info{.number = report.newest,
                            .roundTrip = sample,
                            .rate = static_cast<double>(deliveredPackets_ - acknowledged.deliveredBefore) /
                                    std::max(now - acknowledged.deliveredTime, 1e-6),
                            .deliveredBefore = acknowledged.deliveredBefore};
    bool lost = false;
    for (std::uint32_t i = 0; i + 3 <= place; ++i) {
      if (sent_[i].done) continue;
      sent_[i].done = true;
      --flying_;
      lost |= static_cast<std::int32_t>(first_ + i - recovery_) >= 0;
    }
    while (!sent_.empty() && sent_.front().done) {
      sent_.pop_front();
      ++first_;
    }
    if (lost) {
      recovery_ = next_;
      onLoss(now);
    }
    onAcknowledged(info, now);
    transmit(now);
  }
  void wake(double now) override {
    // Retransmission timeout (RFC 6298, section 2.4, with Linux's minimum).
    if (flying_ > 0 && now - deliveredTime_ > std::max(0.2, 2 * roundTrip_)) {
      sent_.clear();
      first_ = next_;
      flying_ = 0;
      deliveredTime_ = now;
      onTimeout();
    }
    transmit(now);
    // A flow may also ask for other times.
    if (now >= tick_) path_.wakeAt(*this, tick_ = now + 0.1);
  }

 protected:
  struct Acknowledged {
    std::uint32_t number;
    double roundTrip, rate;  // packets/s
    std::uint64_t deliveredBefore;
  };
  virtual void onAcknowledged(const Acknowledged& acknowledged, double now) = 0;
  virtual void onLoss(double now) = 0;
  virtual void onTimeout() = 0;
  virtual void transmit(double now) = 0;

  bool ended(double now) const { return now >= end; }
  void sendOne(double now) {
    if (flying_ == 0) deliveredTime_ = now;
    sent_.push_back({now, deliveredPackets_, deliveredTime_, false});
    ++flying_;
    path_.send(*this, {.number = next_++, .bytes = kBytes});
  }

  Bottleneck& path_;
  double flying_ = 0;  // packets
  double roundTrip_ = 0;
  std::uint64_t deliveredPackets_ = 0;

 private:
  struct Sent {
    double time;
    std::uint64_t deliveredBefore;
    double deliveredTime;
    bool done;
  };
  std::deque<Sent> sent_;
  std::uint32_t first_ = 0, next_ = 0, recovery_ = 0;
  double deliveredTime_ = 0, tick_ = 0;
};

// RFC 9438, with slow start until the first loss. Window in packets.
class CubicFlow final : public RivalFlow {
 public:
  using RivalFlow::RivalFlow;

 private:
  void onAcknowledged(const Acknowledged&, double now) override {
    if (window_ < threshold_) {
      window_ += 1;
      return;
    }
    const double t = now - epoch_ + roundTrip_;
    const double target = plateau_ + 0.4 * std::pow(t - climb_, 3);
    reno_ += (reno_ < prior_ ? 9.0 / 17 : 1) / window_;
    window_ += (std::clamp(target, window_, 1.5 * window_) - window_) / window_;
    window_ = std::max(window_, reno_);
  }
  void onLoss(double now) override {
    prior_ = window_;
    plateau_ = window_ < plateau_ ? 0.85 * window_ : window_;
    window_ = threshold_ = reno_ = std::max(0.7 * window_, 2.0);
    climb_ = std::cbrt((plateau_ - window_) / 0.4);
    epoch_ = now;
  }
  void onTimeout() override {
    threshold_ = std::max(0.7 * window_, 2.0);
    window_ = 1;
  }
  void transmit(double now) override {
    while (flying_ < window_ && !ended(now)) sendOne(now);
  }

  double window_ = 10, threshold_ = std::numeric_limits<double>::max();
  double plateau_ = 0, prior_ = 0, reno_ = 0, climb_ = 0, epoch_ = 0;
};

// Version 1 (draft-cardwell-iccrg-bbr-congestion-control-00): start-up, drain, eight phases of probing for
// bandwidth with a maximum of ten rounds, and a probe of the round trip every ten seconds.
class BbrFlow final : public RivalFlow {
 public:
  using RivalFlow::RivalFlow;

 private:
  enum class State { startUp, drain, probeBandwidth, probeRoundTrip };
  static constexpr std::array kGains{1.25, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  static constexpr double kHigh = 2.885;

  double bandwidth() const { return *std::ranges::max_element(rates_); }
  double product() const { return bandwidth() * shortest_; }

  void onAcknowledged(const Acknowledged& acknowledged, double now) override {
    if (acknowledged.deliveredBefore >= roundEnd_) {
      roundEnd_ = deliveredPackets_;
      ++round_;
      rates_[round_ % rates_.size()] = 0;
      if (state_ == State::startUp) checkFull();
    }
    double& newest = rates_[round_ % rates_.size()];
    newest = std::max(newest, acknowledged.rate);
    if (acknowledged.roundTrip <= shortest_ ||
        (now - shortestTime_ > 10 && state_ != State::probeRoundTrip)) {
      if (acknowledged.roundTrip > shortest_) startProbe_ = true;
      shortest_ = acknowledged.roundTrip;
      shortestTime_ = now;
    }
    advance(now);
  }
  void checkFull() {
    if (bandwidth() >= 1.25 * full_) {
      full_ = bandwidth();
      stalled_ = 0;
    } else if (++stalled_ == 3) {
      state_ = State::drain;
    }
  }
  void advance(double now) {
    if (startProbe_) {
      startProbe_ = false;
      state_ = State::probeRoundTrip;
      probeEnd_ = 0;
    }
    switch (state_) {
      case State::startUp:
        gain_ = windowGain_ = kHigh;
        break;
      case State::drain:
        gain_ = 1 / kHigh;
        windowGain_ = kHigh;
        if (flying_ <= product()) enterBandwidth(now);
        break;
      case State::probeBandwidth:
        windowGain_ = 2;
        if (now - phaseBegin_ > shortest_ && (gain_ <= 1 || flying_ >= gain_ * product()))
          nextPhase(now);
        else if (gain_ < 1 && flying_ <= product())
          nextPhase(now);
        break;
      case State::probeRoundTrip:
        gain_ = 1;
        if (probeEnd_ == 0 && flying_ <= 4) probeEnd_ = now + 0.2;
        if (probeEnd_ > 0 && now >= probeEnd_) {
          shortestTime_ = now;
          enterBandwidth(now);
        }
        break;
    }
  }
  void enterBandwidth(double now) {
    state_ = State::probeBandwidth;
    phase_ = 2 + static_cast<std::size_t>(path_.random() * 6);
    phaseBegin_ = now;
    gain_ = kGains[phase_];
  }
  void nextPhase(double now) {
    phase_ = (phase_ + 1) % kGains.size();
    phaseBegin_ = now;
    gain_ = kGains[phase_];
  }
  void onLoss(double) override {}
  void onTimeout() override {}
  void transmit(double now) override {
    const double window = state_ == State::probeRoundTrip ? 4
                          : bandwidth() > 0               ? std::max(windowGain_ * product(), 4.0)
                                                          : 10;
    while (flying_ < window && now >= due_ && !ended(now)) {
      sendOne(now);
      if (bandwidth() > 0) due_ = std::max(due_, now - 0.001) + 1 / (gain_ * bandwidth());
    }
    if (flying_ < window && timer_ < due_) path_.wakeAt(*this, timer_ = due_);
  }

  State state_ = State::startUp;
  std::array<double, 10> rates_{};  // packets/s, largest of each round
  std::uint64_t round_ = 0, roundEnd_ = 0;
  double shortest_ = std::numeric_limits<double>::max(), shortestTime_ = 0;
  double gain_ = kHigh, windowGain_ = kHigh;
  double full_ = 0;
  int stalled_ = 0;
  std::size_t phase_ = 0;
  double phaseBegin_ = 0, probeEnd_ = 0, due_ = 0, timer_ = -1;
  bool startProbe_ = false;
};

}  // namespace clothstream::delivery
