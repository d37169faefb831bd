// SPDX-License-Identifier: MIT
// Two servers that talk about one move of a scene.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/channel.h"
#include "server/fleet/nats.h"

namespace clothstream::fleet {

// One side. Belongs to one thread, except that messages arrive on another one.
class Conversation {
 public:
  // Waits end when `stopping` becomes true. Both references must outlive it.
  Conversation(Nats& nats, std::string out, const std::string& in, const std::atomic<bool>& stopping);

  void send(const v1::MoveMessage& message);
  // Next message of the other side; nothing if none comes in this time, or if it is not one.
  std::optional<v1::MoveMessage> receive(std::chrono::milliseconds time);
  // Waits until the other side has everything. Returns false if that takes longer.
  bool flush(std::chrono::milliseconds time);

 private:
  // Waits for a segment, and handles those that are there.
  void step();

  Nats& nats_;
  const std::string out_;
  const std::atomic<bool>& stopping_;
  Channel channel_;
  std::deque<delivery::SharedBytes> messages_;

  std::mutex mutex_;  // protects the next one
  std::condition_variable changed_;
  std::deque<v1::Segment> segments_;

  std::unique_ptr<Nats::Subscription> in_;
};

}  // namespace clothstream::fleet
