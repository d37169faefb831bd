// SPDX-License-Identifier: MIT
// Messages that arrive once and in order, over a way that loses some, such as NATS without a connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "server/delivery/envelope.h"
#include "server/fleet/message_assembly.h"
#include "server/schedule/clock.h"

namespace clothstream::fleet {

// One end. Long messages are divided into segments. Segments stay until the other end has their whole
// message, and are sent again if no answer comes. Not thread-safe.
class Channel {
 public:
  using Clock = schedule::Clock;
  using Received = ReceivedMessage;
  using Send = std::function<void(const v1::Segment& segment)>;

  // Bytes that are sent and that the other end has not used; one message more fits always.
  static constexpr std::size_t kWindow = 256 * 1024;
  static constexpr std::size_t kMaxSegmentBytes = 64 * 1024;
  static constexpr std::size_t kSegmentCost = 128;
  static constexpr std::chrono::milliseconds kFirstRepeat{250}, kLongestRepeat{1000}, kAnswerTime{20},
      kKeepAlive{1000};

  // `received`: newest segment that this end has used already, in a former life.
  explicit Channel(std::uint64_t received = 0) : assembly_(received), announced_(received) {}

  // Whether another message would be sent at once.
  bool hasRoom() const { return waiting_.empty() && windowBytes_ < kWindow; }
  // Bytes of messages that the other end has not used, with kSegmentCost for each segment here.
  std::size_t bytes() const {
    return windowBytes_ + waitingBytes_ + kSegmentCost * (waiting_.size() + sent_.size());
  }
  // Whether the other end has received everything.
  bool delivered() const { return waiting_.empty() && sent_.empty(); }

  void push(const delivery::SharedBytes& message, Clock::time_point now);
  void pushEnd(v1::TunnelEnd end);
  // Sends what is new, what must be repeated, and answers.
  void poll(Clock::time_point now, const Send& send);

  // Handles a segment. Returns the messages that are complete now. Segments out of order are dropped.
  [[nodiscard]] std::vector<Received> receive(const v1::Segment& segment, Clock::time_point now);
  // The message of this number, and all before it, are used: the other end may send more.
  void use(std::uint64_t sequence) { assembly_.use(sequence); }

  // Newest segment whose message is complete. Another end continues after it.
  std::uint64_t received() const { return assembly_.whole(); }
  // Whether anything has arrived.
  bool heard() const { return heard_; }
  // The other end is replaced by one that has received everything up to received(). Its own messages begin
  // with the first sequence number again.
  void restart();

 private:
  void queue(v1::Segment segment);
  void transmit(v1::Segment& segment, Clock::time_point now, const Send& send);

  std::uint64_t next_ = 1;                                    // number of the next new segment
  std::deque<v1::Segment> waiting_;                           // not sent yet
  std::deque<v1::Segment> sent_;                              // not acknowledged
  std::deque<std::pair<std::uint64_t, std::size_t>> unused_;  // sent segments that are not used, with sizes
  std::size_t waitingBytes_ = 0, windowBytes_ = 0;
  Clock::time_point progress_{}, lastSent_{};
  Clock::duration repeat_ = kFirstRepeat;

  MessageAssembly assembly_;
  std::uint64_t announced_;  // used segment of which the other end knows
  std::optional<Clock::time_point> answerAt_;
  bool heard_ = false;
};

}  // namespace clothstream::fleet
