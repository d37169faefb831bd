// SPDX-License-Identifier: MIT
// A Vulkan device with one compute queue.
#include "server/vulkan/device.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "server/vulkan/batch_handles.h"
#include "server/vulkan/handles.h"
#include "server/vulkan/instance.h"
#include "server/vulkan/recorder.h"

namespace clothstream::vulkan {
namespace {

constexpr const char* kLost =
    "the Vulkan device was lost (VK_ERROR_DEVICE_LOST): create everything on it again on another device";

// Workgroups that a small GPU runs at the same time.
constexpr std::uint32_t kGpuWorkgroups = 64;

Limits limitsOf(const vk::raii::PhysicalDevice& physical) {
  const auto chain =
      physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceVulkan11Properties>();
  const vk::PhysicalDeviceLimits& limits = chain.get<vk::PhysicalDeviceProperties2>().properties.limits;
  std::uint64_t memory = 0;
  const vk::PhysicalDeviceMemoryProperties heaps = physical.getMemoryProperties();
  for (std::uint32_t i = 0; i < heaps.memoryHeapCount; ++i)
    if (heaps.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
      memory = std::max<std::uint64_t>(memory, heaps.memoryHeaps[i].size);
  return {.maxWorkgroupInvocations = limits.maxComputeWorkGroupInvocations,
          .maxWorkgroupSizeX = limits.maxComputeWorkGroupSize[0],
          .maxDispatchX = limits.maxComputeWorkGroupCount[0],
          .maxSharedBytes = limits.maxComputeSharedMemorySize,
          .maxStorageRange = limits.maxStorageBufferRange,
          .maxTexelElements = limits.maxTexelBufferElements,
          .maxPushConstantBytes = limits.maxPushConstantsSize,
          .parallelWorkgroups = kGpuWorkgroups,
          .subgroupSize = chain.get<vk::PhysicalDeviceVulkan11Properties>().subgroupSize,
          .timestampPeriod = limits.timestampPeriod,
          .deviceMemoryBytes = memory,
          .maxAllocations = limits.maxMemoryAllocationCount};
}

bool offersStatistics(const vk::raii::PhysicalDevice& physical) {
  const auto extensions = physical.enumerateDeviceExtensionProperties();
  return std::ranges::any_of(extensions, [](const vk::ExtensionProperties& extension) {
    return std::string_view(extension.extensionName) == VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
  });
}

bool offersAddresses(const vk::raii::PhysicalDevice& physical) {
  return physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>()
      .get<vk::PhysicalDeviceVulkan12Features>()
      .bufferDeviceAddress;
}

vk::raii::Device openDevice(const Candidate& candidate, bool statistics, bool addresses) {
  const float priority = 1;
  const vk::DeviceQueueCreateInfo queue{
      .queueFamilyIndex = candidate.queueFamily, .queueCount = 1, .pQueuePriorities = &priority};
  vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR executables{.pipelineExecutableInfo = VK_TRUE};
  const vk::PhysicalDeviceVulkan12Features features{.pNext = statistics ? &executables : nullptr,
                                                    .timelineSemaphore = VK_TRUE,
                                                    .bufferDeviceAddress = addresses};
  const char* extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
  return {candidate.physical, vk::DeviceCreateInfo{.pNext = &features,
                                                   .queueCreateInfoCount = 1,
                                                   .pQueueCreateInfos = &queue,
                                                   .enabledExtensionCount = statistics ? 1u : 0u,
                                                   .ppEnabledExtensionNames = &extension}};
}

// Header of a pipeline cache file; the driver's own data follows.
struct CacheFileHeader {
  std::array<char, 8> magic = {'c', 's', 'p', 'i', 'p', 'e', 's', '1'};
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

// FNV-1a checksum. Drivers may not survive damaged data, which must therefore not reach them.
std::uint64_t checksum(std::span<const std::uint8_t> bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001b3u;
  return hash;
}

std::filesystem::path cacheFile(const std::filesystem::path& directory,
                                const vk::PhysicalDeviceProperties& properties) {
  if (directory.empty()) return {};
  std::string name;
  for (const std::uint8_t byte : properties.pipelineCacheUUID) name += fmt::format("{:02x}", byte);
  return directory / (name + ".pipelines");
}

// The driver's data in the file. Empty if the file is missing, damaged, or from another device or driver.
std::vector<std::uint8_t> readCache(const std::filesystem::path& path,
                                    const vk::PhysicalDeviceProperties& properties) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> all{std::istreambuf_iterator<char>(file), {}};
  CacheFileHeader header;
  VkPipelineCacheHeaderVersionOne inner;
  if (all.size() < sizeof(header) + sizeof(inner)) return {};
  std::memcpy(&header, all.data(), sizeof(header));
  std::vector<std::uint8_t> data(all.begin() + sizeof(header), all.end());
  std::memcpy(&inner, data.data(), sizeof(inner));
  const bool sound = header.magic == CacheFileHeader{}.magic && header.bytes == data.size() &&
                     header.checksum == checksum(data);
  const bool ours = inner.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE &&
                    inner.vendorID == properties.vendorID && inner.deviceID == properties.deviceID &&
                    std::equal(std::begin(inner.pipelineCacheUUID), std::end(inner.pipelineCacheUUID),
                               properties.pipelineCacheUUID.begin());
  if (sound && ours) return data;
  spdlog::warn("the pipeline cache {} is damaged or of another driver and will be replaced", path.string());
  return {};
}

// Writes a draft next to the file and renames it, so that a reader never sees half a file.
void writeCache(const std::filesystem::path& path, std::span<const std::uint8_t> data) {
  const CacheFileHeader header{.bytes = data.size(), .checksum = checksum(data)};
  std::filesystem::create_directories(path.parent_path());
  const std::filesystem::path draft = fmt::format("{}.{}", path.string(), getpid());
  {
    std::ofstream file(draft, std::ios::binary);
    file.exceptions(std::ios::failbit | std::ios::badbit);
    file.write(reinterpret_cast<const char*>(&header), sizeof(header));
    file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  }
  std::filesystem::rename(draft, path);
}

}  // namespace

Device::Device(const DeviceOptions& options)
    : handles_(new Handles{.context = openLoader()}), executes_(!options.compileOnly) {
  const SoftwareThreads threads(options.softwareThreads);
  const bool validate = options.validation || validationByEnvironment();
  handles_->instance = makeInstance(handles_->context, validate);
  if (validate) handles_->messenger = makeMessenger(handles_->instance);

  std::vector<Candidate> all = candidates(handles_->instance);
  Candidate& chosen = all[vulkan::select(all, options.select)];
  const vk::PhysicalDeviceProperties properties = chosen.physical.getProperties();
  pipelineCacheFile_ = cacheFile(options.cacheDirectory, properties);
  std::vector<std::uint8_t> cached;
  if (!pipelineCacheFile_.empty()) cached = readCache(pipelineCacheFile_, properties);
  pipelineCacheLoaded_ = cached.size();
  try {
    handles_->keepsStatistics = options.compileOnly && offersStatistics(chosen.physical);
    addresses_ = offersAddresses(chosen.physical);
    handles_->device = openDevice(chosen, handles_->keepsStatistics, addresses_);
    const vk::SemaphoreTypeCreateInfo timeline{.semaphoreType = vk::SemaphoreType::eTimeline};
    handles_->queue = handles_->device.getQueue(chosen.queueFamily, 0);
    // Drivers without a GPU have no semaphores.
    if (executes_)
      handles_->timeline = vk::raii::Semaphore(handles_->device, vk::SemaphoreCreateInfo{.pNext = &timeline});
    handles_->pipelineCache = vk::raii::PipelineCache(
        handles_->device,
        vk::PipelineCacheCreateInfo{.initialDataSize = cached.size(), .pInitialData = cached.data()});
  } catch (const vk::SystemError& error) {
    throw DeviceError(
        fmt::format("the Vulkan device {} cannot be opened: {}", chosen.info.name, error.what()));
  }
  gpuKernels_ = options.kernels == KernelSettings::automatic ? chosen.info.kind != DeviceKind::software
                                                             : options.kernels == KernelSettings::gpu;
  limits_ = limitsOf(chosen.physical);
  if (chosen.info.kind == DeviceKind::software) limits_.parallelWorkgroups = threads.count();
  if (options.maxAllocations > 0) limits_.maxAllocations = options.maxAllocations;
  handles_->queueFamily = chosen.queueFamily;
  const bool shares = options.sharing == KernelSharing::automatic ? chosen.info.kind != DeviceKind::software
                                                                  : options.sharing == KernelSharing::always;
  handles_->sharesKernels = shares && executes_ && addresses_;
  info_ = std::move(chosen.info);
  handles_->physical = std::move(chosen.physical);
  handles_->memory =
      std::make_unique<MemoryBlocks>(handles_->device, handles_->physical.getMemoryProperties(),
                                     MemorySettings{.device = info_.name,
                                                    .maxBlocks = limits_.maxAllocations,
                                                    .largestBlock = options.largestBlock,
                                                    .addresses = addresses_,
                                                    .marksFreshMemory = validate});
  handles_->descriptorPools = std::make_unique<DescriptorPools>(handles_->device);
}

Device::~Device() {
  try {
    if (executes_) handles_->device.waitIdle();
    if (!pipelineCacheFile_.empty()) writeCache(pipelineCacheFile_, handles_->pipelineCache.getData());
  } catch (const std::exception& error) {
    spdlog::warn("closing the Vulkan device {}: {}", info_.name, error.what());
  }
}

TimelineValue Device::submit(Recorder& recorder) {
  recorder.finish();
  return submit(recorder, 0, recorder.sliceCount());
}

TimelineValue Device::submitSlice(Recorder& recorder, std::uint32_t slice) {
  recorder.finish();
  assert(slice < recorder.sliceCount());
  return submit(recorder, slice, slice + 1);
}

TimelineValue Device::submit(const Recorder& recorder, std::uint32_t first, std::uint32_t end) {
  std::vector<vk::CommandBuffer>& submitted = recorder.handles().submitted;
  submitted.clear();
  for (std::uint32_t slice = first; slice < end; ++slice)
    submitted.push_back(*recorder.handles().slices[slice]);
  return submitCommands(submitted.data(), submitted.size());
}

TimelineValue Device::submit(Batch& batch) {
  batch.finish();
  const std::vector<vk::CommandBuffer>& submitted = batch.handles().submitted;
  return submitCommands(submitted.data(), submitted.size());
}

TimelineValue Device::submitCommands(const void* commands, std::size_t count) {
  assert(executes_);
  const std::lock_guard lock(submitting_);
  const TimelineValue value = submitted_ + 1;
  const vk::TimelineSemaphoreSubmitInfo timeline{.signalSemaphoreValueCount = 1,
                                                 .pSignalSemaphoreValues = &value};
  try {
    handles_->queue.submit(vk::SubmitInfo{.pNext = &timeline,
                                          .commandBufferCount = static_cast<std::uint32_t>(count),
                                          .pCommandBuffers = static_cast<const vk::CommandBuffer*>(commands),
                                          .signalSemaphoreCount = 1,
                                          .pSignalSemaphores = &*handles_->timeline});
  } catch (const vk::DeviceLostError&) {
    throw DeviceLost(kLost);
  }
  return submitted_ = value;
}

bool Device::wait(TimelineValue value, std::chrono::nanoseconds timeout) const {
  const auto nanoseconds = static_cast<std::uint64_t>(std::max<std::int64_t>(timeout.count(), 0));
  try {
    return handles_->device.waitSemaphores(
               {.semaphoreCount = 1, .pSemaphores = &*handles_->timeline, .pValues = &value}, nanoseconds) ==
           vk::Result::eSuccess;
  } catch (const vk::DeviceLostError&) {
    throw DeviceLost(kLost);
  }
}

void Device::drain() {
  TimelineValue last = 0;
  {
    const std::lock_guard lock(submitting_);
    last = submitted_;
  }
  wait(last);
}

bool Device::sharesKernels() const {
  return handles_->sharesKernels;
}

std::uint64_t Device::allocatedBytes() const {
  return handles_->memory->usedBytes();
}

std::uint32_t Device::allocations() const {
  return handles_->memory->count();
}

std::uint64_t Device::reservedBytes() const {
  return handles_->memory->bytes();
}

TimelineValue Device::completed() const {
  try {
    return handles_->timeline.getCounterValue();
  } catch (const vk::DeviceLostError&) {
    throw DeviceLost(kLost);
  }
}

}  // namespace clothstream::vulkan
