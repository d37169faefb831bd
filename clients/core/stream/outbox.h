// SPDX-License-Identifier: MIT
// Queue of serialised ClientMessages that wait for the transport.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "clients/core/wire/client_message.h"

namespace clothstream::client {

// Keeps only the newest acknowledgement and the newest poses. Control messages are sent first, in order.
class Outbox {
 public:
  // Limit of waiting control messages. At the limit the transport has stopped sending.
  static constexpr std::size_t kMaxControl = 256;

  // Returns false if the queue is full.
  [[nodiscard]] bool addControl(std::string message);
  void setAck(std::uint64_t tick) { ackTick_ = tick; }
  // Poses that wait to be sent; write to it to replace them.
  std::string& poses() { return poses_; }
  void clear();

  // Returns the next message, or nullptr. Valid until the next call of this function.
  const std::string* next();

 private:
  std::deque<std::string> control_;
  std::string poses_;  // empty if none wait
  std::optional<std::uint64_t> ackTick_;
  std::string taken_;
};

}  // namespace clothstream::client
