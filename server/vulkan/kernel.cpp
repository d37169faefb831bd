// SPDX-License-Identifier: MIT
// A compute pipeline from embedded SPIR-V, and the buffers that are bound to it.
#include "server/vulkan/kernel.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include <fmt/format.h>

#include "server/vulkan/handles.h"
#include "server/vulkan/shared_code.h"

namespace clothstream::vulkan {
namespace {

constexpr std::uint32_t kWord = sizeof(std::uint32_t);

vk::raii::Pipeline pipelineOf(const Device::Handles& device, const Kernel::Handles& kernel,
                              std::span<const std::uint32_t> spirv, vk::PipelineLayout layout) {
  const vk::raii::Device& vulkan = device.device;
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t id = 0; id < kernel.constants.size(); ++id)
    entries.push_back({.constantID = id, .offset = id * kWord, .size = kWord});
  const vk::SpecializationInfo specialisation{.mapEntryCount = static_cast<std::uint32_t>(entries.size()),
                                              .pMapEntries = entries.data(),
                                              .dataSize = kernel.constants.size() * kWord,
                                              .pData = kernel.constants.data()};
  const vk::raii::ShaderModule module(
      vulkan, vk::ShaderModuleCreateInfo{.codeSize = spirv.size_bytes(), .pCode = spirv.data()});
  vk::PipelineCreateFlags flags = vk::PipelineCreateFlagBits::eDispatchBase;
  if (device.keepsStatistics) flags |= vk::PipelineCreateFlagBits::eCaptureStatisticsKHR;
  vk::raii::Pipeline pipeline(
      vulkan, device.pipelineCache,
      vk::ComputePipelineCreateInfo{.flags = flags,
                                    .stage = {.stage = vk::ShaderStageFlagBits::eCompute,
                                              .module = *module,
                                              .pName = "main",
                                              .pSpecializationInfo = &specialisation},
                                    .layout = layout});
  if (device.validates())
    vulkan.setDebugUtilsObjectNameEXT(
        {.objectType = vk::ObjectType::ePipeline,
         .objectHandle = reinterpret_cast<std::uint64_t>(static_cast<VkPipeline>(*pipeline)),
         .pObjectName = kernel.code.name});
  return pipeline;
}

// Makes the pipeline of handles with code, constants and interface.
void makePipeline(const Device::Handles& device, Kernel::Handles& made) {
  const vk::raii::Device& vulkan = device.device;
  std::vector<vk::DescriptorSetLayoutBinding> slots;
  for (const Binding& binding : made.interface.bindings)
    slots.push_back({.binding = static_cast<std::uint32_t>(slots.size()),
                     .descriptorType = typeOf(binding.kind),
                     .descriptorCount = 1,
                     .stageFlags = vk::ShaderStageFlagBits::eCompute});
  made.setLayout = vk::raii::DescriptorSetLayout(
      vulkan, vk::DescriptorSetLayoutCreateInfo{.bindingCount = static_cast<std::uint32_t>(slots.size()),
                                                .pBindings = slots.data()});
  const vk::PushConstantRange push{.stageFlags = vk::ShaderStageFlagBits::eCompute,
                                   .size = made.interface.pushConstantBytes};
  made.layout =
      vk::raii::PipelineLayout(vulkan, vk::PipelineLayoutCreateInfo{.setLayoutCount = 1,
                                                                    .pSetLayouts = &*made.setLayout,
                                                                    .pushConstantRangeCount = push.size > 0,
                                                                    .pPushConstantRanges = &push});
  made.pipeline = pipelineOf(device, made, made.code.spirv, *made.layout);
}

// Throws std::runtime_error if these handles, which have no pipeline yet, exceed what the device allows.
void checkLimits(const Device& device, const Kernel::Handles& handles) {
  const Limits& limits = device.limits();
  const std::uint32_t workgroupSize = handles.constants.front(),
                      most = std::min(limits.maxWorkgroupSizeX, limits.maxWorkgroupInvocations),
                      pushBytes = handles.interface.pushConstantBytes;
  if (workgroupSize > most)
    throw std::runtime_error(fmt::format("kernel {}: a workgroup of {} invocations is more than the {} of {}",
                                         handles.code.name, workgroupSize, most, device.info().name));
  if (pushBytes > limits.maxPushConstantBytes)
    throw std::runtime_error(fmt::format("kernel {}: {} bytes of push constants are more than the {} of {}",
                                         handles.code.name, pushBytes, limits.maxPushConstantBytes,
                                         device.info().name));
}

}  // namespace

Kernel::Kernel(const Device& device, const KernelCode& code, std::uint32_t workgroupSize,
               std::span<const std::uint32_t> specialisation) {
  std::vector<std::uint32_t> constants{workgroupSize};
  constants.insert(constants.end(), specialisation.begin(), specialisation.end());
  const std::scoped_lock lock(device.handles().pipelinesMutex);
  std::weak_ptr<const Handles>& shared = device.handles().pipelines[{code.spirv.data(), constants}];
  handles_ = shared.lock();
  if (handles_) return;
  const auto made = std::make_shared<Handles>();
  made->device = &device.handles();
  made->code = code;
  made->constants = std::move(constants);
  made->interface = interfaceOf(code.spirv);
  checkLimits(device, *made);
  try {
    makePipeline(device.handles(), *made);
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(
        fmt::format("kernel {} is refused by {}: {}", code.name, device.info().name, error.what()));
  }
  shared = handles_ = made;
  if (!device.executes()) device.handles().kept.push_back(made);
}

const Kernel::Handles::Shared& Kernel::Handles::shared() const {
  std::call_once(sharedForm.made, [this] {
    const vk::PushConstantRange push{.stageFlags = vk::ShaderStageFlagBits::eCompute,
                                     .size = sizeof(vk::DeviceAddress)};
    sharedForm.layout = vk::raii::PipelineLayout(
        device->device,
        vk::PipelineLayoutCreateInfo{.pushConstantRangeCount = 1, .pPushConstantRanges = &push});
    sharedForm.pipeline = pipelineOf(*device, *this, sharedCode(code.spirv), *sharedForm.layout);
  });
  return sharedForm;
}

std::string_view Kernel::name() const {
  return handles_->code.name;
}
std::uint32_t Kernel::workgroupSize() const {
  return handles_->constants.front();
}
std::span<const std::uint32_t> Kernel::specialisation() const {
  return std::span(handles_->constants).subspan(1);
}
const SpirvInterface& Kernel::interface() const {
  return handles_->interface;
}

bool Kernel::isReady() const {
  return handles_->ready;
}
void Kernel::setReady() const {
  handles_->ready = true;
}

Bindings::~Bindings() = default;
Bindings::Bindings(Bindings&&) noexcept = default;
Bindings& Bindings::operator=(Bindings&&) noexcept = default;

Bindings::Bindings(const Device& device, Kernel kernel, std::span<const Buffer* const> buffers)
    : kernel_(std::move(kernel)), handles_(std::make_unique<Handles>()) {
  const std::span<const Binding> bindings = kernel_.interface().bindings;
  if (buffers.size() != bindings.size())
    throw std::logic_error(fmt::format("kernel {} has {} bindings and is given {} buffers", kernel_.name(),
                                       bindings.size(), buffers.size()));
  const auto count = static_cast<std::uint32_t>(bindings.size());
  for (const Buffer* buffer : buffers) {
    buffers_.push_back({&buffer->handles(), buffer->bytes()});
    handles_->buffers.push_back({&buffer->handles(), buffer->bytes()});
  }
  if (count == 0 || !device.executes()) return;

  std::vector<vk::DescriptorBufferInfo> infos(count);
  std::vector<vk::WriteDescriptorSet> writes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Buffer& buffer = *buffers[i];
    if (buffer.bytes() > device.limits().maxStorageRange)
      throw std::runtime_error(fmt::format(
          "kernel {}, binding {}: a buffer of {} bytes is more than the {} that kernels "
          "can bind on {}",
          kernel_.name(), i, buffer.bytes(), device.limits().maxStorageRange, device.info().name));
    assert(bindings[i].kind == BindingKind::storage || *buffer.handles().texelView);
    infos[i] = vk::DescriptorBufferInfo{.buffer = *buffer.handles().buffer, .range = VK_WHOLE_SIZE};
    writes.push_back({.dstBinding = i,
                      .descriptorCount = 1,
                      .descriptorType = typeOf(bindings[i].kind),
                      .pBufferInfo = &infos[i],
                      .pTexelBufferView = &*buffer.handles().texelView});
  }
  try {
    handles_->set = PooledSet(*device.handles().descriptorPools, *kernel_.handles().setLayout, bindings);
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(fmt::format("kernel {} cannot be bound: {}", kernel_.name(), error.what()));
  }
  for (vk::WriteDescriptorSet& write : writes) write.dstSet = *handles_->set;
  device.handles().device.updateDescriptorSets(writes, nullptr);
}

}  // namespace clothstream::vulkan
