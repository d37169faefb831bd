// SPDX-License-Identifier: MIT
// Somebody who means a server no good.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "clients/load/link.h"

namespace clothstream::load {

// Comes again and again, each time with another of these: bytes that are no message; poses that are no
// numbers; a message of a megabyte; requests without end whose answers it never reads; gone as soon as it has
// joined.
class Intruder final : private LinkListener {
 public:
  // `first`: of those kinds, the one to begin with.
  Intruder(Links& links, std::string scene, std::size_t first);
  ~Intruder();
  Intruder(const Intruder&) = delete;
  Intruder& operator=(const Intruder&) = delete;

  void step(std::chrono::steady_clock::time_point now);
  // Connections so far.
  std::uint64_t visits() const { return visits_; }

 private:
  void received(std::span<const std::byte> message) override;
  void closed(const std::string&) override { gone_ = true; }
  void visit();
  void drop();
  std::string hello() const;

  Links& endpoint_;
  const std::string scene_;
  std::size_t kind_;
  std::uint64_t visits_ = 0;
  std::chrono::steady_clock::time_point since_{};
  std::atomic<bool> gone_{false}, joined_{false};
  std::unique_ptr<Link> link_;
};

}  // namespace clothstream::load
