// SPDX-License-Identifier: MIT
// A Vulkan device with one compute queue.
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

// Settings of kernels: rows of an invocation, sizes of workgroups, cloths that one workgroup solves. The bits
// of the results do not depend on them. `automatic` means `cpu` for software devices and `gpu` for others.
enum class KernelSettings : std::uint8_t { automatic, cpu, gpu };

// Whether scenes that run together share dispatches (Batch). `automatic`: on GPUs, where a dispatch costs
// more than the work of a small scene. The bits of the results do not depend on it.
enum class KernelSharing : std::uint8_t { automatic, never, always };

struct DeviceInfo {
  std::uint32_t index = 0;  // index in listDevices()
  std::string name = {};
  DeviceKind kind = DeviceKind::other;
  std::string driver = {};      // name and version
  std::string apiVersion = {};  // such as 1.3.230
};

struct DeviceOptions {
  // Empty: the best device (discrete before integrated before software). Otherwise an index of listDevices()
  // or a case-insensitive part of a name.
  std::string select = {};
  // Threads of a software device (LP_NUM_THREADS); set before the instance is created. Absent: the value of
  // the environment, or else the measured default.
  std::optional<std::uint32_t> softwareThreads = {};
  // Enables VK_LAYER_KHRONOS_validation with synchronisation checks. Its messages are counted
  // (validationMessages()) and logged. Where the CPU can, fresh memory of buffers is filled with ones, which
  // are no numbers, so that work on contents that were never written shows. Tests enable it by the
  // environment variable CLOTHSTREAM_VALIDATION=1.
  bool validation = false;
  // Directory of the pipeline cache, with one file per device and driver version; created if missing. Empty:
  // no cache. A damaged file, or one of another driver, is ignored and replaced. A failed write is only
  // logged.
  std::filesystem::path cacheDirectory = {};
  KernelSettings kernels = KernelSettings::automatic;
  // Ignored if the device cannot do it: it needs the feature bufferDeviceAddress.
  KernelSharing sharing = KernelSharing::automatic;
  // Only compile kernels: buffers have no device memory, recordings hold rehearsals only, and nothing may be
  // submitted. A driver without a GPU is enough. Kernels keep the statistics of their compiler
  // (kernel_statistics.h).
  bool compileOnly = false;
  // Allocations of memory that the device may have at a time; 0: as many as the driver allows. For tests.
  std::uint32_t maxAllocations = 0;
  // Bytes of the largest allocation that buffers share; 0: automatic. 1: each buffer has one for itself. For
  // tests.
  std::uint64_t largestBlock = 0;
};

struct Limits {
  std::uint32_t maxWorkgroupInvocations = 0;
  std::uint32_t maxWorkgroupSizeX = 0;
  std::uint32_t maxDispatchX = 0;  // workgroups
  std::uint32_t maxSharedBytes = 0;
  std::uint64_t maxStorageRange = 0;   // bytes per binding
  std::uint64_t maxTexelElements = 0;  // elements per texel-buffer binding
  std::uint32_t maxPushConstantBytes = 0;
  // Workgroups that run at the same time: threads of a software device, an estimate for a GPU.
  std::uint32_t parallelWorkgroups = 1;
  std::uint32_t subgroupSize = 0;
  float timestampPeriod = 0;  // ns per tick of the timestamp counter
  std::uint64_t deviceMemoryBytes = 0;
  std::uint32_t maxAllocations = 0;  // allocations of memory at a time, which buffers share
};

// A value of the queue's timeline. It is reached when all earlier submissions are complete.
using TimelineValue = std::uint64_t;

class Batch;
class Recorder;

// No device, or none that matches `select`. what() says what to install or which devices there are.
class DeviceError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The device was lost (VK_ERROR_DEVICE_LOST). Everything created on it must be created again on another
// Device.
class DeviceLost : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<DeviceInfo> listDevices();

// Name, kind, driver and version, for people.
std::string describe(const DeviceInfo& device);

// Thread-safe, except for destruction. An object created on the device belongs to one thread at a time.
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
  // True if kernels have the settings for GPUs.
  bool hasGpuKernels() const { return gpuKernels_; }
  // False if the device was opened with DeviceOptions::compileOnly.
  bool executes() const { return executes_; }
  // True if recordings of a batch share dispatches.
  bool sharesKernels() const;
  // True if kernels may read and write buffers by their addresses (bufferDeviceAddress of Vulkan 1.2).
  bool hasAddresses() const { return addresses_; }

  // Submits a finished recording to the queue. Returns the timeline value that is reached when it is done.
  // The recorder must not begin again before that. Submissions of one thread run in order. Throws DeviceLost.
  TimelineValue submit(Recorder& recorder);
  // Submits one slice of a recording. The slices must be submitted in order, each once.
  TimelineValue submitSlice(Recorder& recorder, std::uint32_t slice);
  // Submits all recordings of a batch. The batch must not begin again before the value is reached.
  TimelineValue submit(Batch& batch);

  // Returns false on timeout. Throws DeviceLost.
  bool wait(TimelineValue value, std::chrono::nanoseconds timeout = std::chrono::nanoseconds::max()) const;
  TimelineValue completed() const;
  // Waits until all submissions are complete. Throws DeviceLost.
  void drain();

  // Number of messages of the validation layer in this process so far, and the text of the newest ones.
  static std::uint64_t validationMessages();
  static std::vector<std::string> validationTexts();

  // Bytes of pipeline cache that were loaded from DeviceOptions::cacheDirectory.
  std::size_t pipelineCacheLoaded() const { return pipelineCacheLoaded_; }

  // Memory of all buffers on the device, in bytes.
  std::uint64_t allocatedBytes() const;
  // Allocations of memory that buffers on the device share now, and their bytes: at least allocatedBytes().
  std::uint32_t allocations() const;
  std::uint64_t reservedBytes() const;

  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  TimelineValue submit(const Recorder& recorder, std::uint32_t first, std::uint32_t end);
  TimelineValue submitCommands(const void* commands, std::size_t count);  // of vk::CommandBuffer

  std::unique_ptr<Handles> handles_;
  std::size_t pipelineCacheLoaded_ = 0;
  std::mutex submitting_;  // guards the queue and submitted_
  TimelineValue submitted_ = 0;
  DeviceInfo info_;
  Limits limits_;
  bool executes_ = true, gpuKernels_ = true, addresses_ = false;
  std::filesystem::path pipelineCacheFile_;
};

}  // namespace clothstream::vulkan
