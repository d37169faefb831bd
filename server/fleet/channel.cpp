// SPDX-License-Identifier: MIT
#include "server/fleet/channel.h"

#include <algorithm>
#include <utility>

namespace clothstream::fleet {
namespace {

// Used segments of which the other end learns at once, so that a full window does not wait.
constexpr std::uint64_t kUsedAtOnce = 4;

}  // namespace

void Channel::push(const delivery::SharedBytes& message, Clock::time_point now) {
  const auto* const bytes = reinterpret_cast<const char*>(message->data());
  std::size_t at = 0;
  do {
    const std::size_t size = std::min(message->size() - at, kMaxSegmentBytes);
    v1::Segment segment;
    segment.set_data(bytes + at, size);
    at += size;
    segment.set_more(at < message->size());
    segment.set_time_us(schedule::microseconds(now));
    queue(std::move(segment));
  } while (at < message->size());
}

void Channel::pushEnd(v1::TunnelEnd end) {
  v1::Segment segment;
  segment.set_end(end);
  queue(std::move(segment));
}

void Channel::queue(v1::Segment segment) {
  segment.set_sequence(next_++);
  waitingBytes_ += segment.data().size();
  waiting_.push_back(std::move(segment));
}

void Channel::transmit(v1::Segment& segment, Clock::time_point now, const Send& send) {
  segment.set_acknowledged(assembly_.whole());
  segment.set_consumed(assembly_.used());
  lastSent_ = now;
  answerAt_.reset();
  announced_ = assembly_.used();
  send(segment);
}

void Channel::poll(Clock::time_point now, const Send& send) {
  if (!sent_.empty() && now - progress_ >= repeat_) {
    for (v1::Segment& segment : sent_) transmit(segment, now, send);
    progress_ = now;
    repeat_ = std::min<Clock::duration>(2 * repeat_, kLongestRepeat);
  }
  while (!waiting_.empty() && windowBytes_ < kWindow) {
    if (sent_.empty()) progress_ = now;
    sent_.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
    v1::Segment& segment = sent_.back();
    waitingBytes_ -= segment.data().size();
    windowBytes_ += segment.data().size();
    unused_.emplace_back(segment.sequence(), segment.data().size());
    transmit(segment, now, send);
  }
  const std::uint64_t news = assembly_.used() - announced_;
  const bool isUseDue = news >= kUsedAtOnce || (news > 0 && now - lastSent_ >= kAnswerTime);
  if ((answerAt_ && now >= *answerAt_) || isUseDue || now - lastSent_ >= kKeepAlive) {
    v1::Segment answer;
    transmit(answer, now, send);
  }
}

std::vector<Channel::Received> Channel::receive(const v1::Segment& segment, Clock::time_point now) {
  heard_ = true;
  while (!sent_.empty() && sent_.front().sequence() <= segment.acknowledged()) {
    sent_.pop_front();
    progress_ = now;
    repeat_ = kFirstRepeat;
  }
  while (!unused_.empty() && unused_.front().first <= segment.consumed()) {
    windowBytes_ -= unused_.front().second;
    unused_.pop_front();
  }
  if (segment.sequence() == 0) return {};
  // Also a segment that is here already, because its sender has not heard of that.
  if (!answerAt_) answerAt_ = now + kAnswerTime;
  std::vector<Received> complete;
  if (auto message = assembly_.add(segment)) complete.push_back(std::move(*message));
  return complete;
}

void Channel::restart() {
  assembly_ = MessageAssembly(0);
  announced_ = 0;
  heard_ = false;
  progress_ = {};
}

}  // namespace clothstream::fleet
