// SPDX-License-Identifier: MIT
#include "server/fleet/conversation.h"

#include <utility>

#include "server/fleet/message_bytes.h"

namespace clothstream::fleet {
namespace {

using schedule::Clock;

constexpr std::chrono::milliseconds kStep{10};

}  // namespace

Conversation::Conversation(Nats& nats, std::string out, const std::string& in,
                           const std::atomic<bool>& stopping)
    : nats_(nats),
      out_(std::move(out)),
      stopping_(stopping),
      in_(nats.subscribe(in, [this](const auto&, const auto&, auto data) {
        v1::Segment segment;
        if (!parse(data, segment)) return;
        {
          const std::lock_guard lock(mutex_);
          segments_.push_back(std::move(segment));
        }
        changed_.notify_all();
      })) {}

void Conversation::send(const v1::MoveMessage& message) {
  channel_.push(toBytes(message), Clock::now());
  channel_.poll(Clock::now(), [this](const v1::Segment& segment) { nats_.publish(out_, toBytes(segment)); });
}

void Conversation::step() {
  std::deque<v1::Segment> arrived;
  {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kStep, [this] { return !segments_.empty(); });
    arrived = std::exchange(segments_, {});
  }
  const Clock::time_point now = Clock::now();
  for (const v1::Segment& segment : arrived)
    for (Channel::Received& received : channel_.receive(segment, now)) {
      channel_.use(received.sequence);
      if (received.message) messages_.push_back(std::move(received.message));
    }
  channel_.poll(now, [this](const v1::Segment& segment) { nats_.publish(out_, toBytes(segment)); });
}

std::optional<v1::MoveMessage> Conversation::receive(std::chrono::milliseconds time) {
  const Clock::time_point end = Clock::now() + time;
  while (messages_.empty() && !stopping_ && Clock::now() < end) step();
  if (messages_.empty()) return std::nullopt;
  const delivery::SharedBytes bytes = std::move(messages_.front());
  messages_.pop_front();
  v1::MoveMessage message;
  if (!parse(*bytes, message)) return std::nullopt;
  return message;
}

bool Conversation::flush(std::chrono::milliseconds time) {
  const Clock::time_point end = Clock::now() + time;
  while (!channel_.delivered() && !stopping_ && Clock::now() < end) step();
  return channel_.delivered();
}

}  // namespace clothstream::fleet
