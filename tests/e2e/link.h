// SPDX-License-Identifier: MIT
// A link to a server that is as bad as a test wants it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

namespace clothstream::e2e {

// Of each direction by itself. Bytes stay in order, as TCP's do.
struct Impairment {
  std::chrono::microseconds delay{0};
  std::chrono::microseconds jitter{0};  // beside the delay, evenly from 0 to this
  double bytesPerSecond = 0;            // 0: as fast as can be
  // Waiting at the narrow place; who sends more is not read from.
  std::size_t queueBytes = 64 * 1024;
  // Nothing passes, the end of a connection neither: whoever goes meanwhile leaves the other end half open.
  bool stalled = false;
};

// Passes TCP connections on to a port of this machine. Thread-safe.
class Link {
 public:
  // Throws std::exception where there is no port.
  explicit Link(std::uint16_t target);
  // Resets every connection.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  std::uint16_t port() const;
  // From here on; what waits at the narrow place is older.
  void impair(const Impairment& impairment);
  // Resets every connection, and those that come until it is restored.
  void cut();
  // The same, but those that come get no answer at all, until it is restored.
  void swallow();
  void restore();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::e2e
