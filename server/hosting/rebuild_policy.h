// SPDX-License-Identifier: MIT
// Decides whether a scene that failed is rebuilt or given up.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace clothstream::hosting {

// A scene is rebuilt after a failed tick or a loss of the device. It is given up if a tick fails again within
// a simulated second, or if rebuilding it fails twice. Belongs to one thread.
class RebuildPolicy {
 public:
  // A tick failed after `tick` complete ones, of which there are `rate` a second. Returns whether the scene
  // is rebuilt.
  bool tickFailed(std::uint64_t tick, std::uint32_t rate) {
    const std::optional<std::uint64_t> before = std::exchange(failed_, tick);
    rebuildFailed_ = false;
    reason_ = "a tick failed";
    return !before || tick - *before >= rate;
  }
  void deviceLost() {
    rebuildFailed_ = false;
    reason_ = "the device was lost";
  }
  // Rebuilding it failed. Returns whether that is tried again.
  bool rebuildFailed() { return !std::exchange(rebuildFailed_, true); }
  void givenUp() { failed_.reset(); }

  // Event after which the scene is rebuilt, for people.
  const char* reason() const { return reason_; }

 private:
  std::optional<std::uint64_t> failed_;  // tick of the newest failure
  bool rebuildFailed_ = false;           // since then
  const char* reason_ = "";
};

}  // namespace clothstream::hosting
