// SPDX-License-Identifier: MIT
// The Vulkan objects of this folder's classes. They stay out of the public headers, because the Vulkan
// bindings compile slowly.
#pragma once

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
#include "server/vulkan/descriptor_pools.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/memory_blocks.h"
#include "server/vulkan/recorder.h"
#include "server/vulkan/stage_timer.h"

namespace clothstream::vulkan {

struct Kernel::Handles {
  struct Shared {
    std::once_flag made;
    vk::raii::PipelineLayout layout = nullptr;
    vk::raii::Pipeline pipeline = nullptr;
  };
  // The form for several scenes at once (shared_code.h), which the first call makes. Thread-safe.
  const Shared& shared() const;

  const Device::Handles* device = nullptr;
  KernelCode code;
  std::vector<std::uint32_t> constants;  // by constant_id: the workgroup size, then the specialisation
  SpirvInterface interface;
  vk::raii::DescriptorSetLayout setLayout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
  mutable Shared sharedForm;
  mutable std::atomic<bool> ready{false};  // Kernel::isReady()
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
  bool keepsStatistics = false;                   // of kernels: kernel_statistics.h
  bool sharesKernels = false;                     // kernels have shared forms: shared_code.h
  mutable std::atomic<std::uint64_t> batches{0};  // that have begun
  std::unique_ptr<MemoryBlocks> memory = {};
  std::unique_ptr<DescriptorPools> descriptorPools = {};
  // Pipelines that kernels use.
  mutable std::mutex pipelinesMutex{};
  mutable std::map<PipelineKey, std::weak_ptr<const Kernel::Handles>> pipelines{};
  // A device that only compiles keeps every pipeline, so that it compiles none twice.
  mutable std::vector<std::shared_ptr<const Kernel::Handles>> kept{};

  bool validates() const { return *messenger != vk::DebugUtilsMessengerEXT{}; }
};

struct Buffer::Handles {
  std::optional<MemoryRange> range;
  std::vector<std::byte> hostBytes;  // on a device that only compiles, which has no `range`
  vk::raii::Buffer buffer = nullptr;
  vk::raii::BufferView texelView = nullptr;
  vk::DeviceAddress address = 0;  // of its first byte; 0 without Device::hasAddresses()
};

// The first bytes of a buffer, as a shared kernel sees it.
struct BoundBufferAddress {
  const Buffer::Handles* buffer = nullptr;
  std::uint64_t bytes = 0;
};

struct Bindings::Handles {
  std::vector<BoundBufferAddress> buffers;  // in order
  // Address of their record in the table of the newest batch that used them, and the number of that batch.
  mutable vk::DeviceAddress record = 0;
  mutable std::uint64_t batch = 0;
  PooledSet set;
};

struct Recorder::Handles {
  vk::raii::CommandPool pool = nullptr;
  std::vector<vk::raii::CommandBuffer> slices;  // as many as the longest recording had
  std::vector<vk::CommandBuffer> submitted;     // newest submission, to reuse its memory
  std::optional<StageTimer> timer;              // since a recording had stages
};

}  // namespace clothstream::vulkan
