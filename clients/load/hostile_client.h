// SPDX-License-Identifier: MIT
// A misbehaving client for load tests.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "clients/load/link.h"

namespace clothstream::load {

// Connects repeatedly, each time with the next kind of misbehaviour: random bytes; poses with NaN and
// infinity; a message of 1 MiB; endless requests without reading the answers; disconnecting right after
// joining.
class HostileClient final : private LinkListener {
 public:
  // `first` is the index of the first kind, modulo the number of kinds. `token` is sent before hello; empty:
  // none.
  HostileClient(Links& links, std::string scene, std::size_t first, std::string token = {});
  ~HostileClient();
  HostileClient(const HostileClient&) = delete;
  HostileClient& operator=(const HostileClient&) = delete;

  void step(std::chrono::steady_clock::time_point now);
  // Number of connections so far.
  std::uint64_t visits() const { return visits_; }

 private:
  void received(std::span<const std::byte> message) override;
  void closed(const std::string&) override { gone_ = true; }
  void visit();
  void drop();
  std::string hello() const;

  Links& links_;
  const std::string scene_, token_;
  std::size_t kind_;
  std::uint64_t visits_ = 0;
  std::chrono::steady_clock::time_point since_{};
  std::atomic<bool> gone_{false}, joined_{false};
  std::unique_ptr<Link> link_;
};

}  // namespace clothstream::load
