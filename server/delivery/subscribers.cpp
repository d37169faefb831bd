// SPDX-License-Identifier: MIT
#include "server/delivery/subscribers.h"

#include <algorithm>
#include <utility>

namespace clothstream::delivery {

void Subscribers::add(std::shared_ptr<Mailbox> mailbox, std::uint64_t participant) {
  const std::lock_guard lock(mutex_);
  subscribers_.push_back({std::move(mailbox), participant});
}

void Subscribers::remove(const Mailbox& mailbox) {
  const std::lock_guard lock(mutex_);
  std::erase_if(subscribers_,
                [&](const Subscriber& subscriber) { return subscriber.mailbox.get() == &mailbox; });
}

std::size_t Subscribers::size() const {
  const std::lock_guard lock(mutex_);
  return subscribers_.size();
}

void Subscribers::setRelay(std::shared_ptr<Relay> relay) {
  const std::lock_guard lock(mutex_);
  relay_ = std::move(relay);
}

void Subscribers::dropRelay(const Relay& relay) {
  const std::lock_guard lock(mutex_);
  if (relay_.get() == &relay) relay_ = nullptr;
}

std::size_t Subscribers::receivers(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return subscribers_.size() + (relay_ && relay_->requested(now).qualities != 0 ? 1 : 0);
}

std::uint64_t Subscribers::participantOf(const Mailbox& mailbox) const {
  const std::lock_guard lock(mutex_);
  for (const Subscriber& subscriber : subscribers_)
    if (subscriber.mailbox.get() == &mailbox) return subscriber.participant;
  return 0;
}

std::shared_ptr<Mailbox> Subscribers::find(std::uint64_t participant) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(subscribers_, participant, &Subscriber::participant);
  return found == subscribers_.end() ? nullptr : found->mailbox;
}

void Subscribers::publish(const PublishedFrame& frame) {
  if (tap_ && frame.quality == 0 && !frame.repeated) tap_(frame.message);
  {
    const std::lock_guard lock(mutex_);
    receivers_.assign(subscribers_.begin(), subscribers_.end());
    if (relay_) relay_->deliver(frame);
  }
  for (const Subscriber& receiver : receivers_) receiver.mailbox->deliver(frame);
  receivers_.clear();
}

void Subscribers::publishAgain(std::span<const PublishedFrame> frames) {
  std::vector<Subscriber> receivers;
  {
    const std::lock_guard lock(mutex_);
    receivers = subscribers_;
  }
  for (const Subscriber& receiver : receivers) receiver.mailbox->deliver(frames);
}

void Subscribers::announce(const SharedBytes& message) {
  if (tap_) tap_(message);
  std::vector<Subscriber> receivers;
  {
    const std::lock_guard lock(mutex_);
    receivers = subscribers_;
    if (relay_) relay_->announce(message);
  }
  SharedMerges merges;
  for (const Subscriber& receiver : receivers) receiver.mailbox->announce(message, merges);
}

std::size_t Subscribers::announceHere(const SharedBytes& message) {
  std::vector<Subscriber> receivers;
  {
    const std::lock_guard lock(mutex_);
    receivers = subscribers_;
  }
  std::erase_if(receivers, [](const Subscriber& receiver) { return receiver.mailbox->atEdge(); });
  SharedMerges merges;
  for (const Subscriber& receiver : receivers) receiver.mailbox->announce(message, merges);
  return receivers.size();
}

void Subscribers::closeAll(const SharedBytes& last) {
  std::vector<Subscriber> closing;
  {
    const std::lock_guard lock(mutex_);
    closing.swap(subscribers_);
  }
  for (const Subscriber& subscriber : closing) subscriber.mailbox->close(last);
}

RequestedFrames Subscribers::requested(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  RequestedFrames requested;
  for (const Subscriber& subscriber : subscribers_) requested |= subscriber.mailbox->requested(now);
  if (relay_) requested |= relay_->requested(now);
  return requested;
}

std::uint8_t Subscribers::needsKeyFrame() const {
  const std::lock_guard lock(mutex_);
  std::uint8_t qualities = 0;
  for (const Subscriber& subscriber : subscribers_) qualities |= subscriber.mailbox->needsKeyFrame();
  if (relay_) qualities |= relay_->requested(Clock::now()).keyFrames;
  return qualities;
}

bool Subscribers::awaitAcknowledgement() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(
      subscribers_, [](const Subscriber& subscriber) { return subscriber.mailbox->awaitsAcknowledgement(); });
}

bool Subscribers::allRestart() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::all_of(subscribers_,
                             [](const Subscriber& subscriber) { return subscriber.mailbox->isRestarting(); });
}

bool Subscribers::anyRestarts() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(subscribers_,
                             [](const Subscriber& subscriber) { return subscriber.mailbox->isRestarting(); });
}

}  // namespace clothstream::delivery
