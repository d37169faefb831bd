// SPDX-License-Identifier: MIT
#include "server/delivery/mailbox.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clothstream/v1/session.pb.h"

namespace clothstream::delivery {
namespace {

std::size_t costOf(const std::vector<std::byte>& message) {
  return message.size() + Mailbox::kMessageOverhead;
}

SharedBytes operatingPoint(std::uint8_t quality) {
  v1::ServerMessage message;
  message.mutable_operating_point()->set_quality(quality);
  return serialise(message);
}

}  // namespace

bool Mailbox::push(Control& control, SharedBytes message) {
  if (closed_) return true;
  if (!control.messages.empty() && control.bytes + costOf(*message) > kMaxControlBytes) return false;
  control.bytes += costOf(*message);
  control.messages.push_back(std::move(message));
  return true;
}

SharedBytes Mailbox::pop(Control& control) {
  SharedBytes message = std::move(control.messages.front());
  control.messages.pop_front();
  control.bytes -= costOf(*message);
  return message;
}

bool Mailbox::reply(SharedBytes message) {
  {
    const std::lock_guard lock(mutex_);
    if (!push(replies_, std::move(message))) return false;
    endpointWaits_ = false;
  }
  wake();
  return true;
}

void Mailbox::announce(SharedBytes message) {
  SharedMerges merges;
  announce(std::move(message), merges);
}

void Mailbox::announce(SharedBytes message, SharedMerges& merges) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    announcements_.bytes += costOf(*message);
    announcements_.messages.push_back(std::move(message));
    if (announcements_.bytes > mergeBeyond_) mergeAnnouncements(merges);
    if (!streaming_) return;
    endpointWaits_ = false;
  }
  wake();
}

void Mailbox::mergeAnnouncements(SharedMerges& merges) {
  announcements_.messages = merges.of(announcements_.messages);
  announcements_.bytes = 0;
  for (const SharedBytes& message : announcements_.messages) announcements_.bytes += costOf(*message);
  mergeBeyond_ = std::max(kMaxControlBytes, announcements_.bytes + kMinMergeBytes);
}

void Mailbox::subscribe(std::shared_ptr<const DescriptionChunks> description, const StreamShape& shape,
                        telemetry::SceneMetrics& metrics, std::uint8_t finest) {
  {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
    streaming_ = !description_;
    shape_ = shape;
    const auto coarsest = static_cast<std::uint8_t>(shape.qualities - 1);
    quality_ = std::min(finest, coarsest);
    adaptation_ = LinkAdaptation(quality_, coarsest);
    reported_ = 0;
    metrics_ = &metrics;
    endpointWaits_ = false;
  }
  wake();
}

void Mailbox::deliver(const PublishedFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || closed_ || (frame.repeated && !needsKey_)) return;
    adapt(frame.complete);
    if (frame.quality == quality_)
      adaptation_.made(frame.quality, frame.message->size(), frame.complete);
    else if (!frame.key || (shape_.qualities > 1 && frame.quality != chosenQuality()))
      return;
    sinceKey_ = frame.key ? 0 : sinceKey_ + 1;
    if (!hold(frame) || !hasRoom()) return;
    endpointWaits_ = false;
  }
  wake();
}

void Mailbox::deliver(std::span<const PublishedFrame> frames) {
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || closed_ || !needsKey_ || !endpointWaits_ || !hasRoom()) return;
    if (shape_.qualities > 1 && frames.front().quality != chosenQuality()) return;
    if (!hold(frames.front())) return;
    sinceKey_ = 0;
    for (const PublishedFrame& frame : frames.subspan(1)) hold(frame);
    endpointWaits_ = false;
  }
  wake();
}

std::uint8_t Mailbox::chosenQuality() const {
  return shape_.qualities > 1 ? adaptation_.quality() : quality_;
}

void Mailbox::adapt(Clock::time_point now) {
  if (shape_.lockstep) return;
  const bool behind = !held_.empty() || (needsKey_ && !(endpointWaits_ && hasRoom()));
  const std::uint8_t before = adaptation_.quality();
  if (!adaptation_.update(behind, now)) return;
  (adaptation_.quality() < before ? metrics_->stepsUp : metrics_->stepsDown).add();
}

bool Mailbox::hold(const PublishedFrame& frame) {
  if (decodable_ && frame.tick <= *decodable_) return false;
  if (frame.key) {
    dropHeld();
    quality_ = frame.quality;
    needsKey_ = requestsKey_ = false;
  } else if (needsKey_ || frame.referenceTick != newest_) {
    needsKey_ = true;
    countDropped(1);
    return false;
  } else if (!held_.empty() &&
             (held_.size() == kMaxHeld || heldBytes_ + frame.message->size() > kMaxHeldBytes)) {
    adaptation_.dropped(frame.complete);
    dropHeld();
    needsKey_ = true;
    countDropped(1);
    return false;
  }
  held_.push_back(frame);
  heldBytes_ += frame.message->size();
  newest_ = frame.tick;
  return true;
}

void Mailbox::dropHeld() {
  countDropped(held_.size());
  held_.clear();
  heldBytes_ = 0;
}

RequestedFrames Mailbox::requested(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  RequestedFrames requested;
  if (!streaming_ || closed_) return requested;
  adapt(now);
  const auto add = [&](std::uint8_t quality, bool key) {
    const auto bit = static_cast<std::uint8_t>(1u << quality);
    requested |= {.qualities = bit, .keyFrames = key ? bit : std::uint8_t{0}};
  };
  if (!needsKey_) add(quality_, requestsKey_ && sinceKey_ >= kMinKeyFrameDistance);
  if (needsKey_ ? endpointWaits_ && hasRoom() : chosenQuality() != quality_) add(chosenQuality(), true);
  return requested;
}

std::uint8_t Mailbox::needsKeyFrame() const {
  const std::lock_guard lock(mutex_);
  if (!streaming_ || closed_ || !needsKey_ || !endpointWaits_ || !hasRoom()) return 0;
  return static_cast<std::uint8_t>(1u << chosenQuality());
}

bool Mailbox::acknowledge(std::uint64_t tick, Clock::time_point now) {
  {
    const std::lock_guard lock(mutex_);
    if (tick > newestSent_) return false;
    if (!sent_.empty() && sent_.front().tick <= tick) leavesOut_ = sent_.front().tick < tick;
    while (!sent_.empty() && sent_.front().tick <= tick) {
      adaptation_.delivered(sent_.front().bytes);
      // A minimum that grows slowly (by half in about 200 frames), so that a longer route is noticed.
      if (roundTrip_) *roundTrip_ *= 1.002;
      if (sent_.front().tick == tick) {
        const double sample = schedule::seconds(now - sent_.front().time);
        roundTrip_ = roundTrip_ ? std::min(sample, *roundTrip_) : sample;
      }
      sent_.pop_front();
    }
    if (held_.empty() || !hasRoom()) return true;
    endpointWaits_ = false;
  }
  wake();
  return true;
}

bool Mailbox::awaitsAcknowledgement() const {
  const std::lock_guard lock(mutex_);
  return !closed_ && (!streaming_ || !held_.empty() || !sent_.empty());
}

std::optional<std::uint64_t> Mailbox::overdue(Clock::time_point before) const {
  const std::lock_guard lock(mutex_);
  if (!shape_.lockstep || closed_ || sent_.empty() || sent_.front().time >= before) return std::nullopt;
  return sent_.front().tick;
}

void Mailbox::restart() {
  const std::lock_guard lock(mutex_);
  dropHeld();
  sent_.clear();
  decodable_.reset();
  leavesOut_ = false;
  needsKey_ = true;
}

bool Mailbox::isRestarting() const {
  const std::lock_guard lock(mutex_);
  return needsKey_ && !decodable_;
}

void Mailbox::requestKeyFrame() {
  const std::lock_guard lock(mutex_);
  requestsKey_ = true;
}

void Mailbox::close(SharedBytes last) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    closed_ = true;
    held_.clear();
    heldBytes_ = 0;
    description_.reset();
    announcements_ = {};
    // Queued replies are still sent. Their memory stays bounded if the peer does not read them.
    if (last) {
      replies_.bytes += costOf(*last);
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
  // After the end of the session the metrics may no longer exist.
  if (message && metrics_ != nullptr && !closed_) metrics_->sentBytes.add((*message)->size());
  endpointWaits_ = !message;
  return message;
}

std::optional<SharedBytes> Mailbox::take(Clock::time_point now) {
  if (!replies_.messages.empty()) return pop(replies_);
  if (closed_) return std::nullopt;
  if (description_) {
    SharedBytes chunk = description_->chunk(nextChunk_++);
    if (nextChunk_ == description_->count()) {
      description_.reset();
      streaming_ = true;
    }
    return chunk;
  }
  if (!streaming_) return std::nullopt;
  const bool hasFrame = !held_.empty() && hasRoom();
  // In lockstep, the order must not depend on whether a frame waits already when the endpoint looks.
  const bool frameFirst = hasFrame && !shape_.lockstep && announcedBytes_ >= kMaxAnnouncedBytes;
  if (!announcements_.messages.empty() && !frameFirst) {
    SharedBytes message = pop(announcements_);
    announcedBytes_ += message->size();
    return message;
  }
  if (!hasFrame) return std::nullopt;
  if (const std::uint8_t quality = held_.front().quality; quality != reported_) {
    reported_ = quality;
    return operatingPoint(quality);
  }

  const PublishedFrame frame = std::move(held_.front());
  held_.pop_front();
  heldBytes_ -= frame.message->size();
  sent_.push_back({frame.tick, frame.message->size(), now});
  decodable_ = newestSent_ = frame.tick;
  announcedBytes_ = 0;
  metrics_->framesTaken.add();
  metrics_->send.record(schedule::seconds(now - frame.complete));
  return frame.message;
}

std::size_t Mailbox::window() const {
  const double inFlight = std::ceil(roundTrip_.value_or(0) * shape_.rate) + (leavesOut_ ? 1 : 0);
  return kMinWindow + static_cast<std::size_t>(std::min(inFlight, double{kMaxWindow - kMinWindow}));
}

void Mailbox::countDropped(std::size_t frames) {
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

}  // namespace clothstream::delivery
