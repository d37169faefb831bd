// SPDX-License-Identifier: MIT
// Lets long work end early.
#pragma once

#include <functional>
#include <stdexcept>
#include <utility>

namespace clothstream::model {

// The work was cancelled. Its caller knows why.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

// Functions that take one call check() between steps whose time is linear in the size of one mesh.
class Cancellation {
 public:
  // Never cancels.
  Cancellation() = default;
  // `cancelled` is called on the thread that works. It must be fast and must not throw.
  explicit Cancellation(std::function<bool()> cancelled) : cancelled_(std::move(cancelled)) {}

  // Throws Cancelled if the work is not wanted any more.
  void check() const {
    if (cancelled_ && cancelled_()) throw Cancelled();
  }

 private:
  std::function<bool()> cancelled_;
};

}  // namespace clothstream::model
