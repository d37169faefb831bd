// SPDX-License-Identifier: MIT
// The device that all scenes share: opened, measured, and replaced after a loss.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "server/model/price.h"
#include "server/scene/scene_loader.h"
#include "server/schedule/clock.h"
#include "server/simulation/speed_meter.h"
#include "server/vulkan/device.h"

namespace clothstream::hosting {

using schedule::Clock;

// Belongs to the device's thread, except for info(). Everything on the device must be destroyed before
// close() and reopen(), and the loader must be idle (SceneLoader::wait()).
class OwnedDevice {
 public:
  // Has no device at first. `workers` must outlive this; `loaded` is called on the loader's thread after
  // everything that it does.
  OwnedDevice(vulkan::DeviceOptions options, codec::Workers& workers, std::function<void()> loaded);

  // Opens the device and measures its speed. Throws what the device throws.
  void open();
  void close();
  // Replaces the device. Returns false if that fails, which is logged; try again at nextAttempt().
  bool reopen();
  // Earliest time of the next reopen().
  Clock::time_point nextAttempt() const { return nextAttempt_; }

  bool isOpen() const { return device_ != nullptr; }
  // These need an open device.
  vulkan::Device& operator*() const { return *device_; }
  vulkan::Device* operator->() const { return device_.get(); }

  // Memory of all buffers on the device, in bytes.
  std::uint64_t allocatedBytes() const { return device_ ? device_->allocatedBytes() : 0; }
  // Memory of the allocations that buffers share, in bytes.
  std::uint64_t reservedBytes() const { return device_ ? device_->reservedBytes() : 0; }
  // Speed of the device when it was opened.
  const model::DeviceSpeed& speed() const { return speed_; }
  // Measures by which factor it is slower now. Throws vulkan::DeviceLost.
  double slowdown();
  // Loads scenes onto the device.
  scene::SceneLoader& loader() { return loader_; }

  // Device in use, or the newest one. Any thread.
  vulkan::DeviceInfo info() const;

 private:
  const vulkan::DeviceOptions options_;
  std::unique_ptr<vulkan::Device> device_;
  std::unique_ptr<simulation::SpeedMeter> meter_;
  model::DeviceSpeed speed_;
  scene::SceneLoader loader_;
  Clock::time_point nextAttempt_{};

  mutable std::mutex mutex_;  // protects the next one
  vulkan::DeviceInfo info_;
};

}  // namespace clothstream::hosting
