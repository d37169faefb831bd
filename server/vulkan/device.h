// SPDX-License-Identifier: MIT
// A Vulkan device with one compute queue: chosen, opened, its limits asked.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace clothstream::vulkan {

enum class DeviceKind : std::uint8_t { discrete, integrated, virtualGpu, software, other };

struct DeviceInfo {
  std::uint32_t index = 0;  // place in listDevices()
  std::string name = {};
  DeviceKind kind = DeviceKind::other;
  std::string driver = {};      // name and version
  std::string apiVersion = {};  // such as 1.3.230
};

struct DeviceOptions {
  // Empty: the best (discrete before integrated before software). Else an index of listDevices() or a
  // case-insensitive part of a name.
  std::string select = {};
  // Threads of a software device (LP_NUM_THREADS); set before the instance is made. Absent: the environment's
  // value or else the measured default.
  std::optional<std::uint32_t> softwareThreads = {};
  // VK_LAYER_KHRONOS_validation with synchronisation checks; its messages are counted (validationMessages())
  // and logged. Tests switch it on by the environment variable CLOTHSTREAM_VALIDATION=1.
  bool validation = false;
  // Directory of the pipeline cache, one file a device and driver version; made if missing. Empty: none is
  // kept. A file that is damaged or of another driver is ignored and replaced; one that cannot be written is
  // only logged.
  std::filesystem::path cacheDirectory = {};
};

struct Limits {
  std::uint32_t maxWorkgroupInvocations = 0;
  std::uint32_t maxWorkgroupSizeX = 0;
  std::uint32_t maxDispatchX = 0;  // workgroups
  std::uint32_t maxSharedBytes = 0;
  std::uint64_t maxStorageRange = 0;   // bytes a binding
  std::uint64_t maxTexelElements = 0;  // elements a texel-buffer binding
  std::uint32_t maxPushConstantBytes = 0;
  std::uint32_t subgroupSize = 0;
  float timestampPeriod = 0;  // ns a tick of the timestamp counter
  std::uint64_t deviceMemoryBytes = 0;
};

// A queue timeline value: reached when all that was submitted up to it is complete.
using TimelineValue = std::uint64_t;

class Recorder;

// No device at all, or none that matches `select`: what() says what to install or which there are.
class DeviceError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The device was lost (VK_ERROR_DEVICE_LOST): everything made on it must be made anew on another Device.
class DeviceLost : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<DeviceInfo> listDevices();

// Thread-safe but for its end. What is made on it belongs to one thread at a time, whichever.
class Device {
 public:
  // Throws DeviceError.
  explicit Device(const DeviceOptions& options = {});
  ~Device();  // saves the pipeline cache
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceInfo& info() const { return info_; }
  const Limits& limits() const { return limits_; }
  bool isSoftware() const { return info_.kind == DeviceKind::software; }

  // Hands a finished recording to the queue and returns the value that the timeline reaches when it is done.
  // The recorder must not be begun again before that. What one thread submits is done in its order. Throws
  // DeviceLost.
  TimelineValue submit(Recorder& recorder);

  // False on time-out. Throws DeviceLost.
  bool wait(TimelineValue value, std::chrono::nanoseconds timeout = std::chrono::nanoseconds::max()) const;
  TimelineValue completed() const;
  // Returns when all that was submitted is complete. Throws DeviceLost.
  void drain();

  // Messages of the validation layer so far, in this process; text of the newest few.
  static std::uint64_t validationMessages();
  static std::vector<std::string> validationTexts();

  // Bytes of pipeline cache that were taken from DeviceOptions::cacheDirectory.
  std::size_t pipelineCacheLoaded() const { return pipelineCacheLoaded_; }

  // For this room alone (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  std::unique_ptr<Handles> handles_;
  std::size_t pipelineCacheLoaded_ = 0;
  std::mutex submitting_;  // guards the queue and:
  TimelineValue submitted_ = 0;
  DeviceInfo info_;
  Limits limits_;
  std::filesystem::path pipelineCacheFile_;
};

}  // namespace clothstream::vulkan
