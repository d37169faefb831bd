// SPDX-License-Identifier: MIT
// A bottleneck of limited rate with a queue, packet by packet, and the flows that share it. Time is
// simulated; there is no thread and no network.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <queue>
#include <random>
#include <utility>
#include <vector>

namespace clothstream::delivery {

// Times are in s, sizes in bytes.
struct SimulatedPacket {
  std::uint32_t number = 0;
  std::uint32_t bytes = 0;
  bool first = false;  // of its frame
  double queued = 0;   // time at which it reached the queue
};

// Report of a receiver.
struct SimulatedReport {
  std::uint32_t newest = 0;
  std::uint32_t arrivalUs = 0;
  std::uint64_t mask = 0;
};

class Bottleneck;

// A sender and its receiver. `now` is the simulated time.
class Flow {
 public:
  virtual ~Flow() = default;
  // A packet reaches the receiver.
  virtual void arrive(const SimulatedPacket& packet, double now) = 0;
  // A report reaches the sender.
  virtual void report(const SimulatedReport& report, double now) = 0;
  // A time that the flow asked for.
  virtual void wake(double now) = 0;

  static constexpr double kInterval = 0.1;
  std::vector<double> delivered;    // bytes in each interval of kInterval
  std::vector<double> queueDelays;  // of each packet
  std::size_t dropped = 0;          // packets, by the bottleneck
  double firstDrop = -1;

  // Quantile of the queue delays so far.
  double queueQuantile(double part) {
    if (queueDelays.empty()) return 0;
    const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(queueDelays.size() - 1));
    std::ranges::nth_element(queueDelays, queueDelays.begin() + at);
    return queueDelays[static_cast<std::size_t>(at)];
  }
  // Mean rate of arrival in Mbit/s, from one time to another.
  double megabits(double from, double to) const {
    double bytes = 0;
    for (auto i = static_cast<std::size_t>(std::lround(from / kInterval)); i < delivered.size(); ++i)
      if (static_cast<double>(i) * kInterval < to - kInterval / 2) bytes += delivered[i];
    return bytes * 8e-6 / (to - from);
  }
};

struct PathShape {
  double megabits = 10;   // rate of the bottleneck
  double buffer = 0.1;    // of the bottleneck, as a time at its first rate
  double oneWay = 0.025;  // base delay in each direction
  double jitter = 0;      // largest additional delay after the bottleneck, uniform; the order may change
  double loss = 0;        // share of packets lost after the bottleneck
  double burst = 1;       // mean number of packets lost in a row; 1: independent
  double stall = 0;       // time for which the receiver stops, every 0.5 to 2.5 s
  bool codel = false;     // RFC 8289 with its default parameters, in addition to the limit of the buffer
};

class Bottleneck {
 public:
  explicit Bottleneck(const PathShape& path, unsigned seed = 1)
      : shape(path), limit_(path.buffer * path.megabits * 1e6 / 8), random_(seed) {}

  PathShape shape;  // rate, delays and losses may change at any time
  double now() const { return now_; }

  template <typename F, typename... Arguments>
  F& add(Arguments&&... arguments) {
    auto flow = std::make_unique<F>(*this, std::forward<Arguments>(arguments)...);
    F& added = *flow;
    flows_.push_back(std::move(flow));
    return added;
  }

  void send(Flow& flow, SimulatedPacket packet) {
    if (bytes_ + packet.bytes > limit_) return drop(flow);
    packet.queued = now_;
    bytes_ += packet.bytes;
    queue_.push_back({&flow, packet});
    if (queue_.size() == 1 && !serving_) serve();
  }
  // Reports are not lost and not delayed by a queue.
  void reply(Flow& flow, const SimulatedReport& report) {
    push({.time = now_ + shape.oneWay, .kind = Kind::report, .flow = &flow, .report = report});
  }
  void wakeAt(Flow& flow, double time) {
    push({.time = std::max(time, now_), .kind = Kind::wake, .flow = &flow});
  }

  void run(double until) {
    while (!events_.empty() && events_.top().time <= until) {
      const Event event = events_.top();
      events_.pop();
      now_ = event.time;
      switch (event.kind) {
        case Kind::served:
          served(event);
          break;
        case Kind::arrival:
          arrival(event);
          break;
        case Kind::report:
          event.flow->report(event.report, now_);
          break;
        case Kind::wake:
          event.flow->wake(now_);
          break;
      }
    }
    now_ = until;
  }
  // Uniform in [0, 1).
  double random() { return std::uniform_real_distribution<double>()(random_); }

 private:
  enum class Kind { served, arrival, report, wake };
  struct Event {
    double time = 0;
    std::uint64_t order = 0;
    Kind kind = Kind::wake;
    Flow* flow = nullptr;
    SimulatedPacket packet{};
    SimulatedReport report{};
    bool operator<(const Event& other) const {
      return time != other.time ? time > other.time : order > other.order;
    }
  };
  struct Queued {
    Flow* flow;
    SimulatedPacket packet;
  };

  void push(Event event) {
    event.order = order_++;
    events_.push(event);
  }
  void serve() {
    while (!queue_.empty() && shape.codel && codelDrops(queue_.front().packet)) drop(*pop().flow);
    serving_ = !queue_.empty();
    if (!serving_) return;
    const Queued next = pop();
    push({.time = now_ + next.packet.bytes * 8e-6 / shape.megabits,
          .kind = Kind::served,
          .flow = next.flow,
          .packet = next.packet});
  }
  void drop(Flow& flow) {
    if (flow.dropped++ == 0) flow.firstDrop = now_;
  }
  Queued pop() {
    const Queued next = queue_.front();
    queue_.pop_front();
    bytes_ -= next.packet.bytes;
    return next;
  }
  void served(const Event& event) {
    Flow& flow = *event.flow;
    flow.queueDelays.push_back(now_ - event.packet.queued);
    if (!lostOnTheWay())
      push({.time = afterStall(now_ + shape.oneWay + shape.jitter * random()),
            .kind = Kind::arrival,
            .flow = event.flow,
            .packet = event.packet});
    serve();
  }
  void arrival(const Event& event) {
    auto& delivered = event.flow->delivered;
    const auto interval = static_cast<std::size_t>(now_ / Flow::kInterval);
    if (delivered.size() <= interval) delivered.resize(interval + 1);
    delivered[interval] += event.packet.bytes;
    event.flow->arrive(event.packet, now_);
  }
  // Time at which the receiver handles a packet that reaches it at `time`.
  double afterStall(double time) {
    if (shape.stall <= 0) return time;
    while (stallEnd_ < time) stallEnd_ += 0.5 + 2 * random() + shape.stall;
    return time >= stallEnd_ - shape.stall ? stallEnd_ : time;
  }
  // Two-state chain of Gilbert.
  bool lostOnTheWay() {
    if (shape.loss <= 0 || shape.loss >= 1) return shape.loss > 0;
    const double leave = shape.burst > 1 ? 1 / shape.burst : 1 - shape.loss;
    const double enter = leave * shape.loss / (1 - shape.loss);
    losing_ = random() < (losing_ ? 1 - leave : enter);
    return losing_;
  }
  // RFC 8289, section 5: drops while the sojourn time has stayed above the target for an interval.
  bool codelDrops(const SimulatedPacket& packet) {
    constexpr double kTarget = 0.005, kInterval = 0.1;
    const bool above = now_ - packet.queued >= kTarget && bytes_ > 1500;
    if (!above) {
      firstAbove_ = 0;
      dropping_ = false;
      return false;
    }
    if (firstAbove_ == 0) firstAbove_ = now_ + kInterval;
    if (!dropping_) {
      if (now_ < firstAbove_) return false;
      dropping_ = true;
      drops_ = now_ - dropNext_ < 16 * kInterval && drops_ > 2 ? drops_ - 2 : 1;
      dropNext_ = now_ + kInterval / std::sqrt(drops_);
      return true;
    }
    if (now_ < dropNext_) return false;
    ++drops_;
    dropNext_ += kInterval / std::sqrt(drops_);
    return true;
  }

  double now_ = 0;
  const double limit_;
  std::priority_queue<Event> events_;
  std::uint64_t order_ = 0;
  std::deque<Queued> queue_;
  double bytes_ = 0;
  double stallEnd_ = 0;
  bool serving_ = false, losing_ = false, dropping_ = false;
  double firstAbove_ = 0, dropNext_ = 0;
  unsigned drops_ = 0;
  std::mt19937 random_;
  std::vector<std::unique_ptr<Flow>> flows_;
};

}  // namespace clothstream::delivery
