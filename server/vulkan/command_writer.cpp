// SPDX-License-Identifier: MIT
#include "server/vulkan/command_writer.h"

#include <utility>
#include <variant>

#include "server/vulkan/handles.h"

namespace clothstream::vulkan {
namespace {

using Access = vk::AccessFlagBits;
using Stage = vk::PipelineStageFlagBits;

constexpr vk::PipelineStageFlags kWork = Stage::eComputeShader | Stage::eTransfer;
constexpr vk::AccessFlags kWrites = Access::eShaderWrite | Access::eTransferWrite;
constexpr vk::AccessFlags kUses = Access::eShaderRead | Access::eShaderWrite | Access::eTransferRead |
                                  Access::eTransferWrite | Access::eIndirectCommandRead;

// Stage, reads and writes of a command, by CommandWriter::Type.
struct CommandAccess {
  Stage stage;
  vk::AccessFlags writes, uses;
};
constexpr CommandAccess kAccess[] = {
    {Stage::eComputeShader, Access::eShaderWrite, Access::eShaderRead | Access::eShaderWrite},
    {Stage::eTransfer, Access::eTransferWrite, Access::eTransferRead | Access::eTransferWrite},
    {Stage::eDrawIndirect, {}, Access::eIndirectCommandRead},
};

}  // namespace

void CommandWriter::begin(const vk::raii::CommandBuffer& commands) {
  commands_ = &commands;
  counts_ = {};
  since_ = 0;
  before_.fill(0);
  commands_->begin(vk::CommandBufferBeginInfo{});
}

void CommandWriter::end() {
  const vk::MemoryBarrier memory{.srcAccessMask = kWrites, .dstAccessMask = kUses | Access::eHostRead};
  commands_->pipelineBarrier(kWork, kWork | Stage::eDrawIndirect | Stage::eHost, {}, memory, nullptr,
                             nullptr);
  commands_->end();
}

void CommandWriter::write(const Command& command, const Recording& recording) {
  std::visit([&](const auto& one) { writeOne(one, recording); }, command);
}

void CommandWriter::writeOne(const Dispatch& dispatch, const Recording& recording) {
  bind(*dispatch.kernel, *dispatch.bindings, dispatch.push, recording);
  // Synchronisation checks of the validation layer do not know vkCmdDispatchBase.
  if (dispatch.firstGroup == 0)
    commands_->dispatch(dispatch.groups, 1, 1);
  else
    commands_->dispatchBase(dispatch.firstGroup, 0, 0, dispatch.groups, 1, 1);
}

void CommandWriter::writeOne(const IndirectDispatch& dispatch, const Recording& recording) {
  waitBefore(sizeCommand);
  bind(*dispatch.kernel, *dispatch.bindings, dispatch.push, recording);
  commands_->dispatchIndirect(*dispatch.sizes->buffer, dispatch.offset);
}

void CommandWriter::writeOne(const Copy& copied, const Recording&) {
  copy(*copied.from->buffer, *copied.to->buffer,
       {.srcOffset = copied.fromOffset, .dstOffset = copied.toOffset, .size = copied.bytes});
}

void CommandWriter::writeOne(const Fill& fill, const Recording&) {
  waitBefore(copyCommand);
  commands_->fillBuffer(*fill.buffer->buffer, fill.offset, fill.bytes, fill.value);
}

void CommandWriter::writeOne(const Touch& touch, const Recording& recording) {
  bind(*touch.kernel, *touch.bindings, touch.push, recording);
  commands_->dispatch(0, 1, 1);
  if (touch.kernel->device->sharesKernels) dispatchShared(*touch.kernel, 0, 0, 1);
}

void CommandWriter::dispatchShared(const Kernel::Handles& kernel, vk::DeviceAddress entries,
                                   std::uint32_t groups, std::uint32_t count) {
  waitBefore(kernelCommand);
  const Kernel::Handles::Shared& shared = kernel.shared();
  commands_->bindPipeline(vk::PipelineBindPoint::eCompute, *shared.pipeline);
  commands_->pushConstants<vk::DeviceAddress>(*shared.layout, vk::ShaderStageFlagBits::eCompute, 0, entries);
  commands_->dispatch(groups, count, 1);
}

void CommandWriter::copy(vk::Buffer from, vk::Buffer to, const vk::BufferCopy& range) {
  waitBefore(copyCommand);
  commands_->copyBuffer(from, to, range);
}

void CommandWriter::bind(const Kernel::Handles& kernel, const Bindings::Handles& bindings, PushRange push,
                         const Recording& recording) {
  waitBefore(kernelCommand);
  commands_->bindPipeline(vk::PipelineBindPoint::eCompute, *kernel.pipeline);
  if (*bindings.set)
    commands_->bindDescriptorSets(vk::PipelineBindPoint::eCompute, *kernel.layout, 0, *bindings.set, nullptr);
  if (push.bytes > 0)
    commands_->pushConstants<std::byte>(*kernel.layout, vk::ShaderStageFlagBits::eCompute, 0,
                                        recording.push(push));
}

void CommandWriter::barrier() {
  for (std::uint8_t& before : before_) before |= since_;
  since_ = 0;
}

void CommandWriter::waitBefore(Type type) {
  const std::uint8_t before = std::exchange(before_[type], std::uint8_t{0});
  since_ |= static_cast<std::uint8_t>(1u << type);
  if (type == kernelCommand) ++counts_.dispatches;
  if (type == copyCommand) ++counts_.copies;
  if (before == 0) return;
  vk::PipelineStageFlags stages;
  vk::AccessFlags writes;
  for (std::uint32_t other = 0; other < kTypes; ++other) {
    if ((before >> other & 1u) == 0) continue;
    stages |= kAccess[other].stage;
    writes |= kAccess[other].writes;
  }
  ++counts_.barriers;
  const vk::MemoryBarrier memory{.srcAccessMask = writes, .dstAccessMask = kAccess[type].uses};
  commands_->pipelineBarrier(stages, kAccess[type].stage, {}, memory, nullptr, nullptr);
}

}  // namespace clothstream::vulkan
