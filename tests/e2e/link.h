// SPDX-License-Identifier: MIT
// A link to a server that can be cut, and returns.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace clothstream::e2e {

// Passes TCP connections on to a port of this machine.
class Link {
 public:
  // Throws std::system_error where there is no port.
  explicit Link(std::uint16_t target);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  std::uint16_t port() const { return port_; }
  // Resets every connection, and those that come until it is restored.
  void cut() { whole_ = false; }
  void restore() { whole_ = true; }

 private:
  struct Pair {
    int client, server;
  };
  void run();
  void accept();

  const std::uint16_t target_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> whole_{true}, stopping_{false};
  std::vector<Pair> pairs_;  // the thread's own
  std::thread thread_;
};

}  // namespace clothstream::e2e
