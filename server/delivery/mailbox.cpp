// SPDX-License-Identifier: MIT
#include "server/delivery/mailbox.h"

#include <algorithm>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "proto/datagram/frame_pieces.h"

namespace clothstream::delivery {
namespace {

SharedBytes operatingPoint(std::uint8_t quality) {
  v1::ServerMessage message;
  message.mutable_operating_point()->set_quality(quality);
  return serialise(message);
}

}  // namespace

bool Mailbox::reply(SharedBytes message) {
  {
    const std::lock_guard lock(mutex_);
    if (!closed_ && !control_.reply(std::move(message))) return false;
    arrived(Outlet::stream);
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
    control_.announce(std::move(message), merges);
    if (!streaming_) return;
    arrived(Outlet::stream);
  }
  wake();
}

void Mailbox::subscribe(std::shared_ptr<const DescriptionChunks> description, const StreamShape& shape,
                        telemetry::SceneMetrics& metrics, std::uint8_t finest) {
  {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
    streaming_ = !description_;
    acknowledged_ = false;
    shape_ = shape;
    const auto coarsest = static_cast<std::uint8_t>(shape.qualities - 1);
    quality_ = std::min(finest, coarsest);
    adaptation_ = LinkAdaptation(quality_, coarsest);
    reported_ = 0;
    metrics_ = &metrics;
    arrived(Outlet::stream);
  }
  wake();
}

void Mailbox::deliver(const PublishedFrame& frame) {
  std::optional<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || closed_ || (frame.repeated && !held_.needsKey())) return;
    adapt(frame.complete);
    if (frame.quality == quality_)
      adaptation_.made(frame.quality, frame.message->size(), frame.complete);
    else if (!frame.key || (shape_.qualities > 1 && frame.quality != chosenQuality()))
      return;
    sinceKey_ = frame.key ? 0 : sinceKey_ + 1;
    if (hold(frame)) outlet = noteFrame();
  }
  wake(outlet);
}

void Mailbox::deliver(std::span<const PublishedFrame> frames) {
  std::optional<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    if (!streaming_ || closed_ || !held_.needsKey() || !outletsWait() || !hasRoom()) return;
    if (shape_.qualities > 1 && frames.front().quality != chosenQuality()) return;
    if (!hold(frames.front())) return;
    sinceKey_ = 0;
    for (const PublishedFrame& frame : frames.subspan(1)) hold(frame);
    outlet = noteFrame();
  }
  wake(outlet);
}

std::uint8_t Mailbox::chosenQuality() const {
  return shape_.qualities > 1 ? adaptation_.quality() : quality_;
}

void Mailbox::adapt(Clock::time_point now) {
  if (shape_.lockstep) return;
  const bool behind = !held_.empty() || (held_.needsKey() && !(outletsWait() && hasRoom()));
  const std::uint8_t before = adaptation_.quality();
  if (!adaptation_.update(behind, now, usesLink() ? std::optional(link_->frameRate) : std::nullopt)) return;
  (adaptation_.quality() < before ? metrics_->stepsUp : metrics_->stepsDown).add();
}

bool Mailbox::hold(const PublishedFrame& frame) {
  if (const auto newest = window_.newest(); newest && frame.tick <= *newest) return false;
  const HeldFrames::Added added = held_.add(frame);
  countDropped(added.dropped);
  if (added.overflowed) adaptation_.dropped(frame.complete);
  if (frame.key) {
    quality_ = frame.quality;
    requestsKey_ = false;
  }
  return added.held;
}

void Mailbox::setLink(std::optional<Link> link) {
  std::optional<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    if (usesLink() && !link && window_.inFlight() > 0) {
      window_.abandon();
      countDropped(held_.restart());
    }
    link_ = link;
    if (!closed_) outlet = noteFrame();
  }
  wake(outlet);
}

void Mailbox::setFrameWake(std::function<void()> wake) {
  const std::lock_guard lock(wakeMutex_);
  frameWake_ = std::move(wake);
}

std::optional<Mailbox::Outlet> Mailbox::outletOfFrame() const {
  if (held_.empty() || !hasRoom()) return std::nullopt;
  return usesLink() && datagram::FramePieces::fits(held_.front().message->size()) ? Outlet::link
                                                                                  : Outlet::stream;
}

std::optional<Mailbox::Outlet> Mailbox::noteFrame() {
  const std::optional<Outlet> outlet = outletOfFrame();
  if (outlet) arrived(*outlet);
  return outlet;
}

bool Mailbox::wantsFinerQuality() const {
  const std::lock_guard lock(mutex_);
  return streaming_ && !closed_ && adaptation_.wantsFiner();
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
  if (!held_.needsKey()) add(quality_, requestsKey_ && sinceKey_ >= kMinKeyFrameDistance);
  if (held_.needsKey() ? outletsWait() && hasRoom() : chosenQuality() != quality_) add(chosenQuality(), true);
  return requested;
}

std::uint8_t Mailbox::needsKeyFrame() const {
  const std::lock_guard lock(mutex_);
  if (!streaming_ || closed_ || !held_.needsKey() || !outletsWait() || !hasRoom()) return 0;
  return static_cast<std::uint8_t>(1u << chosenQuality());
}

bool Mailbox::acknowledge(std::uint64_t tick, Clock::time_point now) {
  std::optional<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    const std::optional<std::size_t> bytes = window_.acknowledge(tick, now);
    if (!bytes) return false;
    acknowledged_ = true;
    adaptation_.delivered(*bytes);
    outlet = noteFrame();
  }
  wake(outlet);
  return true;
}

bool Mailbox::awaitsAcknowledgement() const {
  const std::lock_guard lock(mutex_);
  return !closed_ && (!streaming_ || !held_.empty() || window_.oldest() != nullptr);
}

std::optional<std::uint64_t> Mailbox::overdue(Clock::time_point before) const {
  const std::lock_guard lock(mutex_);
  const SendWindow::Sent* const oldest = window_.oldest();
  if (!shape_.lockstep || closed_ || oldest == nullptr || oldest->time >= before) return std::nullopt;
  return oldest->tick;
}

void Mailbox::restart() {
  const std::lock_guard lock(mutex_);
  countDropped(held_.restart());
  window_.restart();
}

bool Mailbox::isRestarting() const {
  const std::lock_guard lock(mutex_);
  return held_.needsKey() && !window_.newest();
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
    description_.reset();
    // Queued replies are still sent. Their memory stays bounded if the peer does not read them.
    control_.end(std::move(last));
  }
  wake();
}

bool Mailbox::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::optional<SharedBytes> Mailbox::next(Clock::time_point now) {
  std::optional<SharedBytes> message;
  std::optional<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    message = take(now);
    // After the end of the session the metrics may no longer exist.
    if (message && metrics_ != nullptr && !closed_) metrics_->sentBytes.add((*message)->size());
    streamWaits_ = !message;
    // A frame that was too long for the link has left, or the peer has its first one.
    if (usesLink() && linkWaits_ && !closed_) outlet = noteFrame();
  }
  if (outlet == Outlet::link) wake(outlet);
  return message;
}

std::optional<SharedBytes> Mailbox::nextFrame(Clock::time_point now) {
  SharedBytes frame;
  bool toStream = false;  // something for next()
  {
    const std::lock_guard lock(mutex_);
    if (!closed_ && outletOfFrame() == Outlet::link) {
      const std::uint8_t quality = held_.front().quality;
      if (quality != reported_ && control_.reply(operatingPoint(quality))) {
        reported_ = quality;
        toStream = true;
      }
      frame = takeFrame(now);
      metrics_->datagramFrames.add();
      metrics_->sentBytes.add(frame->size());
      toStream |= outletOfFrame() == Outlet::stream;
      if (toStream) arrived(Outlet::stream);
    }
    linkWaits_ = !frame;
  }
  if (toStream) wake();
  return frame ? std::optional(std::move(frame)) : std::nullopt;
}

std::optional<SharedBytes> Mailbox::take(Clock::time_point now) {
  if (SharedBytes reply = control_.nextReply()) return reply;
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
  const bool hasFrame = outletOfFrame() == Outlet::stream;
  // In lockstep, the order must not depend on whether a frame waits already when the endpoint looks.
  const bool frameFirst = hasFrame && !shape_.lockstep && control_.framesComeFirst();
  if (SharedBytes announcement = frameFirst ? nullptr : control_.nextAnnouncement()) return announcement;
  if (!hasFrame) return std::nullopt;
  if (const std::uint8_t quality = held_.front().quality; quality != reported_) {
    reported_ = quality;
    return operatingPoint(quality);
  }
  return takeFrame(now);
}

SharedBytes Mailbox::takeFrame(Clock::time_point now) {
  const PublishedFrame frame = held_.take();
  window_.send({frame.tick, frame.message->size(), now});
  control_.frameSent();
  metrics_->framesTaken.add();
  metrics_->send.record(schedule::seconds(now - frame.complete));
  return frame.message;
}

void Mailbox::countDropped(std::size_t frames) {
  if (metrics_ != nullptr) metrics_->framesDropped.add(frames);
}

void Mailbox::wake(std::optional<Outlet> outlet) {
  if (outlet) call(*outlet == Outlet::stream ? wake_ : frameWake_);
}

void Mailbox::call(const std::function<void()>& wake) {
  const std::lock_guard lock(wakeMutex_);
  if (wake) wake();
}

void Mailbox::silence() {
  const std::lock_guard lock(wakeMutex_);
  wake_ = nullptr;
}

}  // namespace clothstream::delivery
