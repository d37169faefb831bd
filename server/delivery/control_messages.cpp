// SPDX-License-Identifier: MIT
#include "server/delivery/control_messages.h"

#include <algorithm>
#include <utility>

namespace clothstream::delivery {
namespace {

std::size_t costOf(const SharedBytes& message) {
  return message->size() + ControlMessages::kMessageOverhead;
}

}  // namespace

void ControlMessages::push(Queue& queue, SharedBytes message) {
  queue.bytes += costOf(message);
  queue.messages.push_back(std::move(message));
}

SharedBytes ControlMessages::pop(Queue& queue) {
  if (queue.messages.empty()) return nullptr;
  SharedBytes message = std::move(queue.messages.front());
  queue.messages.pop_front();
  queue.bytes -= costOf(message);
  return message;
}

bool ControlMessages::reply(SharedBytes message) {
  if (!replies_.messages.empty() && replies_.bytes + costOf(message) > kMaxBytes) return false;
  push(replies_, std::move(message));
  return true;
}

void ControlMessages::announce(SharedBytes message, SharedMerges& merges) {
  push(announcements_, std::move(message));
  if (announcements_.bytes <= mergeBeyond_) return;
  announcements_.messages = merges.of(announcements_.messages);
  announcements_.bytes = 0;
  for (const SharedBytes& merged : announcements_.messages) announcements_.bytes += costOf(merged);
  mergeBeyond_ = std::max(kMaxBytes, announcements_.bytes + kMinMergeBytes);
}

void ControlMessages::end(SharedBytes last) {
  announcements_ = {};
  if (last) push(replies_, std::move(last));
}

SharedBytes ControlMessages::nextAnnouncement() {
  SharedBytes message = pop(announcements_);
  if (message) announcedBytes_ += message->size();
  return message;
}

}  // namespace clothstream::delivery
