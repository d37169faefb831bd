// SPDX-License-Identifier: MIT
// Faults of the device that tests ask for.
#pragma once

#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/vulkan/device.h"

namespace clothstream::hosting {

// Thread-safe.
class SimulatedFaults {
 public:
  // The next check() throws vulkan::DeviceLost.
  void loseDevice() {
    const std::lock_guard lock(mutex_);
    losesDevice_ = true;
  }
  // The next check() throws an error that belongs to no scene.
  void fail() {
    const std::lock_guard lock(mutex_);
    fails_ = true;
  }
  // checkScene() throws vulkan::DeviceLost for this scene. An empty name ends this.
  void loseDeviceIn(std::string scene) {
    const std::lock_guard lock(mutex_);
    losesDeviceIn_ = std::move(scene);
  }
  // The next `times` calls of checkScene() for this scene throw another error.
  void failIn(std::string scene, int times) {
    const std::lock_guard lock(mutex_);
    failsIn_ = std::move(scene);
    failures_ = times;
  }
  // The next checkBatch() throws another error.
  void failBatch() {
    const std::lock_guard lock(mutex_);
    failsBatch_ = true;
  }

  void check() {
    const std::lock_guard lock(mutex_);
    if (std::exchange(losesDevice_, false)) throw vulkan::DeviceLost("the loss of the device is simulated");
    if (std::exchange(fails_, false)) throw std::runtime_error("a failure is simulated");
  }
  void checkScene(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (!losesDeviceIn_.empty() && losesDeviceIn_ == name)
      throw vulkan::DeviceLost("the loss of the device in a scene is simulated");
    if (failures_ == 0 || failsIn_ != name) return;
    --failures_;
    throw std::runtime_error("a failure in a scene is simulated");
  }
  void checkBatch() {
    const std::lock_guard lock(mutex_);
    if (std::exchange(failsBatch_, false)) throw std::runtime_error("a failed submission is simulated");
  }

 private:
  std::mutex mutex_;
  bool losesDevice_ = false, fails_ = false, failsBatch_ = false;
  std::string losesDeviceIn_, failsIn_;
  int failures_ = 0;  // in failsIn_
};

}  // namespace clothstream::hosting
