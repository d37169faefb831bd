// SPDX-License-Identifier: MIT
// All who are in a scene.
#include "server/stream/audience.h"

#include <algorithm>
#include <utility>

namespace clothstream::stream {

Audience::Joining Audience::join(std::shared_ptr<Mailbox> mailbox, std::size_t limit) {
  const std::lock_guard lock(mutex_);
  if (closed_) return Joining::closed;
  if (members_.size() >= limit) return Joining::full;
  members_.push_back(std::move(mailbox));
  return Joining::joined;
}

void Audience::dismiss(const SharedBytes& last) {
  std::vector<std::shared_ptr<Mailbox>> members;
  {
    const std::lock_guard lock(mutex_);
    members.swap(members_);
  }
  for (const auto& member : members) member->close(last);
}

void Audience::close(const SharedBytes& last) {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  dismiss(last);
}

void Audience::leave(const Mailbox& mailbox) {
  const std::lock_guard lock(mutex_);
  std::erase_if(members_, [&](const auto& member) { return member.get() == &mailbox; });
}

std::size_t Audience::size() const {
  const std::lock_guard lock(mutex_);
  return members_.size();
}

void Audience::publish(const PublishedFrame& frame) {
  if (journal_ && frame.quality == 0 && !frame.again) journal_->sent(frame.message);
  {
    const std::lock_guard lock(mutex_);
    receivers_.assign(members_.begin(), members_.end());
  }
  for (const auto& receiver : receivers_) receiver->deliver(frame);
  receivers_.clear();
}

void Audience::announce(const SharedBytes& message) {
  if (journal_) journal_->sent(message);
  std::vector<std::shared_ptr<Mailbox>> receivers;
  {
    const std::lock_guard lock(mutex_);
    receivers = members_;
  }
  for (const auto& receiver : receivers)
    if (!receiver->announce(message)) receiver->close(tooSlow());
}

FrameWishes Audience::wishes(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  FrameWishes wishes;
  for (const auto& member : members_) wishes |= member->wishes(now);
  return wishes;
}

std::uint8_t Audience::lacks() const {
  const std::lock_guard lock(mutex_);
  std::uint8_t lacks = 0;
  for (const auto& member : members_) lacks |= member->lacks();
  return lacks;
}

}  // namespace clothstream::stream
