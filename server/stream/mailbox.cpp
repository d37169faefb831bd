// SPDX-License-Identifier: MIT
// What waits to be sent to one subscriber.
#include "server/stream/mailbox.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace clothstream::stream {

bool Mailbox::push(Control& control, SharedBytes message) {
  if (closed_) return true;
  if (!control.messages.empty() && control.bytes + message->size() > kMaxControlBytes) return false;
  control.bytes += message->size();
  control.messages.push_back(std::move(message));
  return true;
}

SharedBytes Mailbox::pop(Control& control) {
  SharedBytes message = std::move(control.messages.front());
  control.messages.pop_front();
  control.bytes -= message->size();
  return message;
}

bool Mailbox::reply(SharedBytes message) {
  {
    const std::lock_guard lock(mutex_);
    if (!push(replies_, std::move(message))) return false;
    doorWaits_ = false;
  }
  wake();
  return true;
}

bool Mailbox::announce(SharedBytes message) {
  bool ready = false;
  {
    const std::lock_guard lock(mutex_);
    if (!push(announcements_, std::move(message))) return false;
    ready = streaming_;
    if (ready) doorWaits_ = false;
  }
  if (ready) wake();
  return true;
}

void Mailbox::subscribe(std::shared_ptr<const Description> description, std::uint32_t streamRate,
                        telemetry::SceneMetrics& metrics) {
  {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
    streaming_ = !description_;
    streamRate_ = streamRate;
    metrics_ = &metrics;
    doorWaits_ = false;
  }
  wake();
}

void Mailbox::deliver(const PublishedFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || closed_) return;
    if (frame.key) {
      drop(held_.size());
      held_.clear();
      needsKey_ = wantsKey_ = false;
    } else if (needsKey_ || frame.referenceTick != chainTick_) {
      drop(1);
      needsKey_ = true;
      return;
    } else if (held_.size() == kMaxHeld) {
      drop(held_.size() + 1);
      held_.clear();
      needsKey_ = true;
      return;
    }
    held_.push_back(frame);
    chainTick_ = frame.tick;
    if (!hasRoom()) return;
    doorWaits_ = false;
  }
  wake();
}

bool Mailbox::wantsKeyFrame() const {
  const std::lock_guard lock(mutex_);
  if (!streaming_ || closed_) return false;
  return wantsKey_ || (needsKey_ && doorWaits_ && hasRoom());
}

bool Mailbox::acknowledge(std::uint64_t tick, Clock::time_point now) {
  {
    const std::lock_guard lock(mutex_);
    if (tick > newestSent_) return false;
    while (!sent_.empty() && sent_.front().tick <= tick) {
      if (sent_.front().tick == tick) {
        const double sample = seconds(now - sent_.front().time);
        // The shortest, but it creeps up (by half in some 200 frames) so that a route that became longer is
        // noticed.
        roundTrip_ = roundTrip_ ? std::min(sample, *roundTrip_ * 1.002) : sample;
      }
      sent_.pop_front();
    }
    if (held_.empty() || !hasRoom()) return true;
    doorWaits_ = false;
  }
  wake();
  return true;
}

void Mailbox::restart() {
  const std::lock_guard lock(mutex_);
  drop(held_.size());
  held_.clear();
  sent_.clear();
  needsKey_ = true;
}

void Mailbox::wantKeyFrame() {
  const std::lock_guard lock(mutex_);
  wantsKey_ = true;
}

void Mailbox::close(SharedBytes last) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    closed_ = true;
    held_.clear();
    description_.reset();
    announcements_ = {};
    // Answers that were on their way are worth having; a peer that does not read them only holds what it
    // held.
    if (last) {
      replies_.bytes += last->size();
      replies_.messages.push_back(std::move(last));
    }
  }
  wake();
}

bool Mailbox::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::optional<SharedBytes> Mailbox::next(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  std::optional<SharedBytes> message = take(now);
  doorWaits_ = !message;
  return message;
}

std::optional<SharedBytes> Mailbox::take(Clock::time_point now) {
  if (!replies_.messages.empty()) return pop(replies_);
  if (closed_) return std::nullopt;
  if (description_) {
    SharedBytes chunk = description_->chunks[nextChunk_++];
    if (nextChunk_ == description_->chunks.size()) {
      description_.reset();
      streaming_ = true;
    }
    return chunk;
  }
  if (!streaming_) return std::nullopt;
  if (!announcements_.messages.empty()) return pop(announcements_);
  if (held_.empty() || !hasRoom()) return std::nullopt;

  const PublishedFrame frame = std::move(held_.front());
  held_.pop_front();
  sent_.push_back({frame.tick, now});
  newestSent_ = frame.tick;
  metrics_->framesTaken.add();
  metrics_->send.record(seconds(now - frame.complete));
  return frame.message;
}

std::size_t Mailbox::window() const {
  const double inFlight = std::ceil(roundTrip_.value_or(0) * streamRate_);
  return kMinWindow + static_cast<std::size_t>(std::min(inFlight, double{kMaxWindow - kMinWindow}));
}

void Mailbox::drop(std::size_t frames) {
  if (metrics_ != nullptr) metrics_->framesDropped.add(frames);
}

void Mailbox::wake() {
  const std::lock_guard lock(wakeMutex_);
  if (wake_) wake_();
}

void Mailbox::silence() {
  const std::lock_guard lock(wakeMutex_);
  wake_ = nullptr;
}

}  // namespace clothstream::stream
