// SPDX-License-Identifier: MIT
// The Vulkan objects of this folder's classes. They stay out of the public headers, because the Vulkan
// bindings compile slowly.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "server/vulkan/stage_timer.h"

namespace clothstream::vulkan {

struct Kernel::Handles {
  // The form for several scenes at once (shared_code.h), made when it is first needed. Thread-safe.
  struct Shared {
    std::once_flag made;
    vk::raii::PipelineLayout layout = nullptr;
    vk::raii::Pipeline pipeline = nullptr;
  };
  const Shared& shared() const;

  const Device::Handles* device = nullptr;
  KernelCode code;
  std::vector<std::uint32_t> constants;  // by constant_id: the workgroup size, then the specialisation
  SpirvInterface interface;
  vk::raii::DescriptorSetLayout setLayout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
  std::unique_ptr<Shared> sharedForm = std::make_unique<Shared>();
};

// Address of the embedded SPIR-V, and Kernel::Handles::constants.
using PipelineKey = std::pair<const std::uint32_t*, std::vector<std::uint32_t>>;

struct Device::Handles {
  vk::raii::Context context;
  vk::raii::Instance instance = nullptr;
  vk::raii::DebugUtilsMessengerEXT messenger = nullptr;
  vk::raii::PhysicalDevice physical = nullptr;
  vk::raii::Device device = nullptr;
  vk::raii::Queue queue = nullptr;
  vk::raii::Semaphore timeline = nullptr;
  vk::raii::PipelineCache pipelineCache = nullptr;
  std::uint32_t queueFamily = 0;
  bool keepsStatistics = false;  // of kernels: kernel_statistics.h
  bool sharesKernels = false;    // kernels have shared forms: shared_code.h
  mutable std::atomic<std::uint64_t> allocatedBytes{0};
  mutable std::atomic<std::uint32_t> allocations{0};
  // Pipelines that kernels use.
  mutable std::mutex pipelinesMutex{};
  mutable std::map<PipelineKey, std::weak_ptr<const Kernel::Handles>> pipelines{};
  // A device that only compiles keeps every pipeline, so that it compiles none twice.
  mutable std::vector<std::shared_ptr<const Kernel::Handles>> kept{};

  bool validates() const { return *messenger != vk::DebugUtilsMessengerEXT{}; }
};

inline thread_local std::uint64_t bufferBytesOfThread = 0;  // Buffer::bytesOfThread()

struct Buffer::Handles {
  explicit Handles(const Device& of) : device(of.handles()) {}
  ~Handles() {
    device.allocatedBytes -= bytes;
    bufferBytesOfThread -= bytes;
    if (counted) --device.allocations;
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;

  const Device::Handles& device;
  std::uint64_t bytes = 0;  // of `memory`
  bool counted = false;     // among the device's allocations
  vk::raii::DeviceMemory memory = nullptr;
  std::vector<std::byte> hostBytes;  // on a device that only compiles, which has no `memory`
  vk::raii::Buffer buffer = nullptr;
  vk::raii::BufferView texelView = nullptr;
};

struct Bindings::Handles {
  std::vector<const Buffer::Handles*> buffers;  // in order
  vk::raii::DescriptorPool pool = nullptr;
  vk::raii::DescriptorSet set = nullptr;
};

struct Recorder::Handles {
  vk::raii::CommandPool pool = nullptr;
  std::vector<vk::raii::CommandBuffer> slices;  // as many as the longest recording had
  std::vector<vk::CommandBuffer> submitted;     // newest submission, to reuse its memory
  std::optional<StageTimer> timer;              // since a recording had stages
};

}  // namespace clothstream::vulkan
