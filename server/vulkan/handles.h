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

namespace clothstream::vulkan {

struct Kernel::Handles {
  KernelCode code;
  std::vector<std::uint32_t> constants;  // by constant_id: the workgroup size, then the specialisation
  SpirvInterface interface;
  vk::raii::DescriptorSetLayout setLayout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
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

struct Bindings::Handles {
  PooledSet set;
};

struct Recorder::Handles {
  vk::raii::CommandPool pool = nullptr;
  std::vector<vk::raii::CommandBuffer> slices;
  std::uint32_t used = 0;                    // slices of the present recording
  std::vector<vk::CommandBuffer> submitted;  // newest submission, to reuse its memory
  vk::raii::CommandBuffer& current() { return slices[used - 1]; }
  // Mark i begins stage marks_[i]; one more mark ends the last stage.
  vk::raii::QueryPool timestamps = nullptr;
};

}  // namespace clothstream::vulkan
