// SPDX-License-Identifier: MIT
// A compute pipeline from embedded SPIR-V, and the buffers that are bound to it.
#include "server/vulkan/kernel.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "server/vulkan/handles.h"

namespace clothstream::vulkan {
namespace {

constexpr vk::DescriptorType typeOf(BindingKind kind) {
  switch (kind) {
    case BindingKind::texels:
      return vk::DescriptorType::eUniformTexelBuffer;
    case BindingKind::images:
      return vk::DescriptorType::eStorageTexelBuffer;
    case BindingKind::storage:
      break;
  }
  return vk::DescriptorType::eStorageBuffer;
}

constexpr std::uint32_t kWord = sizeof(std::uint32_t);

}  // namespace

std::shared_ptr<const Kernel::Handles> Kernel::makePipeline(const Device::Handles& device,
                                                            const KernelDescription& description,
                                                            std::span<const std::uint32_t> constants) {
  std::vector<vk::DescriptorSetLayoutBinding> slots;
  for (const BindingKind kind : description.bindings)
    slots.push_back({.binding = static_cast<std::uint32_t>(slots.size()),
                     .descriptorType = typeOf(kind),
                     .descriptorCount = 1,
                     .stageFlags = vk::ShaderStageFlagBits::eCompute});
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t id = 0; id < constants.size(); ++id)
    entries.push_back({.constantID = id, .offset = id * kWord, .size = kWord});
  const vk::SpecializationInfo specialisation{.mapEntryCount = static_cast<std::uint32_t>(entries.size()),
                                              .pMapEntries = entries.data(),
                                              .dataSize = constants.size_bytes(),
                                              .pData = constants.data()};
  const vk::PushConstantRange push{.stageFlags = vk::ShaderStageFlagBits::eCompute,
                                   .size = description.pushConstantBytes};
  const vk::raii::Device& vulkan = device.device;
  auto made = std::make_shared<Handles>();
  made->setLayout = vk::raii::DescriptorSetLayout(
      vulkan, vk::DescriptorSetLayoutCreateInfo{.bindingCount = static_cast<std::uint32_t>(slots.size()),
                                                .pBindings = slots.data()});
  made->layout = vk::raii::PipelineLayout(
      vulkan, vk::PipelineLayoutCreateInfo{.setLayoutCount = 1,
                                           .pSetLayouts = &*made->setLayout,
                                           .pushConstantRangeCount = description.pushConstantBytes > 0,
                                           .pPushConstantRanges = &push});
  const vk::raii::ShaderModule module(vulkan,
                                      vk::ShaderModuleCreateInfo{.codeSize = description.spirv.size_bytes(),
                                                                 .pCode = description.spirv.data()});
  vk::PipelineCreateFlags flags = vk::PipelineCreateFlagBits::eDispatchBase;
  if (device.keepsStatistics) flags |= vk::PipelineCreateFlagBits::eCaptureStatisticsKHR;
  made->pipeline =
      vk::raii::Pipeline(vulkan, device.pipelineCache,
                         vk::ComputePipelineCreateInfo{.flags = flags,
                                                       .stage = {.stage = vk::ShaderStageFlagBits::eCompute,
                                                                 .module = *module,
                                                                 .pName = "main",
                                                                 .pSpecializationInfo = &specialisation},
                                                       .layout = *made->layout});
  if (device.validates())
    vulkan.setDebugUtilsObjectNameEXT(
        {.objectType = vk::ObjectType::ePipeline,
         .objectHandle = reinterpret_cast<std::uint64_t>(static_cast<VkPipeline>(*made->pipeline)),
         .pObjectName = description.name});
  return made;
}

Kernel::~Kernel() = default;
Kernel::Kernel(Kernel&&) noexcept = default;
Kernel& Kernel::operator=(Kernel&&) noexcept = default;

Kernel::Kernel(const Device& device, const KernelDescription& description)
    : name_(description.name),
      bindings_(description.bindings),
      pushConstantBytes_(description.pushConstantBytes),
      workgroupSize_(description.workgroupSize),
      spirv_(description.spirv),
      specialisation_(description.specialisation) {
  const Limits& limits = device.limits();
  if (workgroupSize_ > limits.maxWorkgroupSizeX || workgroupSize_ > limits.maxWorkgroupInvocations)
    throw std::runtime_error(fmt::format(
        "kernel {}: a workgroup of {} invocations is more than the {} of {}", name_, workgroupSize_,
        std::min(limits.maxWorkgroupSizeX, limits.maxWorkgroupInvocations), device.info().name));
  if (pushConstantBytes_ > limits.maxPushConstantBytes)
    throw std::runtime_error(fmt::format("kernel {}: {} bytes of push constants are more than the {} of {}",
                                         name_, pushConstantBytes_, limits.maxPushConstantBytes,
                                         device.info().name));

  std::vector<std::uint32_t> constants{workgroupSize_};
  constants.insert(constants.end(), description.specialisation.begin(), description.specialisation.end());
  try {
    const std::scoped_lock lock(device.handles().pipelinesMutex);
    auto& shared =
        device.handles().pipelines[{description.spirv.data(), bindings_, pushConstantBytes_, constants}];
    handles_ = shared.lock();
    if (!handles_) {
      shared = handles_ = makePipeline(device.handles(), description, constants);
      if (!device.executes()) device.handles().kept.push_back(handles_);
    }
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(
        fmt::format("kernel {} is refused by {}: {}", name_, device.info().name, error.what()));
  }
}

Bindings::~Bindings() = default;
Bindings::Bindings(Bindings&&) noexcept = default;
Bindings& Bindings::operator=(Bindings&&) noexcept = default;

Bindings::Bindings(const Device& device, const Kernel& kernel, std::span<const Buffer* const> buffers)
    : kernel_(&kernel), handles_(std::make_unique<Handles>()) {
  const std::span<const BindingKind> kinds = kernel.bindings();
  assert(buffers.size() == kinds.size());
  const auto count = static_cast<std::uint32_t>(kinds.size());
  for (const Buffer* buffer : buffers) buffers_.push_back({&buffer->handles(), buffer->bytes()});
  if (count == 0 || !device.executes()) return;

  std::vector<vk::DescriptorPoolSize> sizes;
  std::vector<vk::DescriptorBufferInfo> infos(count);
  std::vector<vk::WriteDescriptorSet> writes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Buffer& buffer = *buffers[i];
    if (buffer.bytes() > device.limits().maxStorageRange)
      throw std::runtime_error(
          fmt::format("kernel {}, binding {}: a buffer of {} bytes is more than the {} that kernels "
                      "can bind on {}",
                      kernel.name(), i, buffer.bytes(), device.limits().maxStorageRange, device.info().name));
    assert(kinds[i] == BindingKind::storage || *buffer.handles().texelView);
    infos[i] = vk::DescriptorBufferInfo{.buffer = *buffer.handles().buffer, .range = VK_WHOLE_SIZE};
    sizes.push_back({.type = typeOf(kinds[i]), .descriptorCount = 1});
    writes.push_back({.dstBinding = i,
                      .descriptorCount = 1,
                      .descriptorType = typeOf(kinds[i]),
                      .pBufferInfo = &infos[i],
                      .pTexelBufferView = &*buffer.handles().texelView});
  }
  const vk::raii::Device& vulkan = device.handles().device;
  try {
    handles_->pool = vk::raii::DescriptorPool(
        vulkan, vk::DescriptorPoolCreateInfo{.flags = vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet,
                                             .maxSets = 1,
                                             .poolSizeCount = count,
                                             .pPoolSizes = sizes.data()});
    vk::raii::DescriptorSets sets(vulkan,
                                  vk::DescriptorSetAllocateInfo{.descriptorPool = *handles_->pool,
                                                                .descriptorSetCount = 1,
                                                                .pSetLayouts = &*kernel.handles().setLayout});
    handles_->set = std::move(sets.front());
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(fmt::format("kernel {} cannot be bound: {}", kernel.name(), error.what()));
  }
  for (vk::WriteDescriptorSet& write : writes) write.dstSet = *handles_->set;
  vulkan.updateDescriptorSets(writes, nullptr);
}

}  // namespace clothstream::vulkan
