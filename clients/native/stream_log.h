// SPDX-License-Identifier: MIT
// Log of one native client.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "clients/core/core.h"
#include "clients/native/failure.h"

namespace clothstream {

enum class LogLevel { info = 1, warning = 2, error = 3 };

// Receives lines without a line break. May be empty.
using OnLog = std::function<void(LogLevel, const std::string& text)>;

// Makes lines from what happens to the stream of one client.
class StreamLog {
 public:
  StreamLog(OnLog onLog, std::string address) : onLog_(std::move(onLog)), address_(std::move(address)) {}

  // `events` as cs_receive returns them.
  void received(cs_client* client, std::uint32_t events);
  // The connection is lost, or an attempt to reconnect has failed.
  void lost(const Failure& why);
  // The server has named another one, at this address.
  void redirected(const std::string& address);
  void nextAttempt(std::chrono::microseconds in);
  void ended(const Failure& why, bool left);

 private:
  template <typename... Parts>
  void say(LogLevel level, const Parts&... parts);

  OnLog onLog_;
  std::string address_;
  bool joined_ = false;
};

}  // namespace clothstream
