// SPDX-License-Identifier: MIT
#include "server/hosting/owned_device.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

namespace clothstream::hosting {
namespace {

constexpr std::chrono::seconds kAttemptInterval{1};

}  // namespace

OwnedDevice::OwnedDevice(vulkan::DeviceOptions options, codec::Workers& workers, std::function<void()> loaded)
    : options_(std::move(options)), loader_(workers, std::move(loaded)) {}

void OwnedDevice::open() {
  device_ = std::make_unique<vulkan::Device>(options_);
  meter_ = std::make_unique<simulation::SpeedMeter>(*device_);
  speed_ = meter_->measure();
  const std::lock_guard lock(mutex_);
  info_ = device_->info();
}

void OwnedDevice::close() {
  meter_.reset();
  device_.reset();
}

bool OwnedDevice::reopen() {
  nextAttempt_ = Clock::now() + kAttemptInterval;
  close();
  try {
    open();
  } catch (const std::exception& failure) {
    spdlog::error("device: {}; trying again", failure.what());
    return false;
  }
  return true;
}

double OwnedDevice::slowdown() {
  const model::DeviceSpeed now = meter_->measure();
  return std::max(now.nodeStepSeconds / speed_.nodeStepSeconds, now.dispatchSeconds / speed_.dispatchSeconds);
}

vulkan::DeviceInfo OwnedDevice::info() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

}  // namespace clothstream::hosting
