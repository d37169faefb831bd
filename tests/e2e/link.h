// SPDX-License-Identifier: MIT
// TCP proxy that delays, limits, stalls or cuts connections to a server.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

namespace clothstream::e2e {

// Applied to each direction separately. The order of bytes is kept.
struct Impairment {
  std::chrono::microseconds delay{0};
  std::chrono::microseconds jitter{0};  // added to the delay, uniform from 0 to this
  double bytesPerSecond = 0;            // 0: unlimited
  // Bytes that may wait for the limited rate. The proxy does not read more from the sender.
  std::size_t queueBytes = 64 * 1024;
  // Nothing passes, not even the end of a connection, which then stays half open.
  bool stalled = false;
};

// Forwards TCP connections to a port of this machine. Thread-safe.
class Link {
 public:
  // Throws std::exception if no port can be opened.
  explicit Link(std::uint16_t target);
  // Resets every connection.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  std::uint16_t port() const;
  // Applies to bytes read from now on. Bytes that already wait keep their old due time.
  void impair(const Impairment& impairment);
  // Resets every connection, and each new one until restore().
  void cut();
  // Resets every connection. New ones get no answer at all until restore().
  void swallow();
  void restore();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::e2e
