// SPDX-License-Identifier: MIT
// Serialised ClientMessages that wait for the transport.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include "clients/core/wire/client_message.h"

namespace clothstream::client {

// Of acknowledgements and of poses only the newest says anything: a transport that is behind skips
// the others.
class Outbox {
 public:
  // More control messages than this means a transport that takes nothing.
  static constexpr std::size_t kMaxControl = 256;

  // False if there is no room.
  [[nodiscard]] bool addControl(std::string message);
  void setAck(std::uint64_t tick) { ackTick_ = tick; }
  // Replaces what waits.
  std::string& poses() { return poses_; }
  void clear();

  // nullptr where there is nothing; valid until the next call of this function.
  const std::string* next();

 private:
  std::deque<std::string> control_;
  std::string poses_;  // empty: none waits
  std::optional<std::uint64_t> ackTick_;
  std::string taken_;
};

}  // namespace clothstream::client
