// SPDX-License-Identifier: MIT
// Records work for the device: bind, push, dispatch, copy, barrier, timestamp.
#include "server/vulkan/recorder.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "server/vulkan/handles.h"

namespace clothstream::vulkan {
namespace {

using Access = vk::AccessFlagBits;
using Stage = vk::PipelineStageFlagBits;

constexpr vk::PipelineStageFlags kWork = Stage::eComputeShader | Stage::eTransfer;
constexpr vk::AccessFlags kWrites = Access::eShaderWrite | Access::eTransferWrite;
// Timestamps of a recording: one before each stage and one at the end, and two between slices.
constexpr std::uint32_t kMaxTimestamps = Recorder::kMaxMarks + 1 + 2 * Recorder::kMaxTimedSlices;
// Stage of the time between two slices, in which other work may run.
constexpr std::string_view kBetweenSlices;

// Least work of a dispatch that shares a larger one. A dispatch costs a software device up to 0.1 ms, and
// this work about 1 ms.
constexpr std::uint64_t kLeastDispatch = 1 << 16;

// Stage, reads and writes of a command, by Recorder::Command.
struct CommandAccess {
  Stage stage;
  vk::AccessFlags writes, uses;
};
constexpr CommandAccess kAccess[] = {
    {Stage::eComputeShader, Access::eShaderWrite, Access::eShaderRead | Access::eShaderWrite},
    {Stage::eTransfer, Access::eTransferWrite, Access::eTransferRead | Access::eTransferWrite},
    {Stage::eDrawIndirect, {}, Access::eIndirectCommandRead},
};

constexpr vk::AccessFlags kUses = Access::eShaderRead | Access::eShaderWrite | Access::eTransferRead |
                                  Access::eTransferWrite | Access::eIndirectCommandRead;

}  // namespace

Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;

Recorder::Recorder(const Device& device) : device_(&device), handles_(std::make_unique<Handles>()) {
  if (!device.executes()) return;
  const vk::raii::Device& vulkan = device.handles().device;
  handles_->pool = vk::raii::CommandPool(
      vulkan, vk::CommandPoolCreateInfo{.queueFamilyIndex = device.handles().queueFamily});
  const std::uint32_t bits =
      device.handles().physical.getQueueFamilyProperties()[device.handles().queueFamily].timestampValidBits;
  if (bits > 0)
    handles_->timestamps = vk::raii::QueryPool(
        vulkan,
        vk::QueryPoolCreateInfo{.queryType = vk::QueryType::eTimestamp, .queryCount = kMaxTimestamps});
  timestampMask_ = bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  marks_.reserve(kMaxTimestamps);
  ticks_.resize(kMaxTimestamps);
  times_.reserve(kMaxStages);
}

std::uint32_t Recorder::sliceCount() const {
  return handles_->used;
}

void Recorder::begin() {
  open_ = true;
  rehearses_ = !device_->executes();
  if (rehearses_) return rehearsed_.clear();
  handles_->pool.reset();
  handles_->used = 0;
  beginSlice();
  if (*handles_->timestamps) handles_->current().resetQueryPool(*handles_->timestamps, 0, kMaxTimestamps);
  marks_.clear();
  timedSlices_ = 0;
  largestDispatch_ = mostOfDispatch_ = 0;
}

void Recorder::beginSlice() {
  if (handles_->used == handles_->slices.size()) {
    vk::raii::CommandBuffers all(device_->handles().device,
                                 vk::CommandBufferAllocateInfo{.commandPool = *handles_->pool,
                                                               .level = vk::CommandBufferLevel::ePrimary,
                                                               .commandBufferCount = 1});
    handles_->slices.push_back(std::move(all.front()));
  }
  ++handles_->used;
  invocations_ = most_ = 0;
  since_ = 0;
  before_.fill(0);
  handles_->current().begin(vk::CommandBufferBeginInfo{});
}

void Recorder::endSlice() {
  const vk::MemoryBarrier memory{.srcAccessMask = kWrites, .dstAccessMask = kUses | Access::eHostRead};
  handles_->current().pipelineBarrier(kWork, kWork | Stage::eDrawIndirect | Stage::eHost, {}, memory, nullptr,
                                      nullptr);
  handles_->current().end();
}

void Recorder::count(std::uint64_t invocations, std::uint64_t most) {
  most = std::max(most, invocations);
  if (most_ > 0 && (invocations_ + invocations > sliceInvocations_ || most_ + most > sliceMost_)) {
    if (marks_.empty() || timedSlices_ == kMaxTimedSlices) {
      endSlice();
      beginSlice();
    } else {
      const std::string_view stage = marks_.back();
      beginStage(kBetweenSlices);
      endSlice();
      beginSlice();
      beginStage(stage);
      ++timedSlices_;
    }
  }
  invocations_ += invocations;
  most_ += most;
  largestDispatch_ = std::max(largestDispatch_, invocations);
  mostOfDispatch_ = std::max(mostOfDispatch_, most);
}

void Recorder::beginRehearsal() {
  begin();
  rehearsed_.clear();
  rehearses_ = true;
}

void Recorder::note(const Bindings& bindings, std::uint64_t invocations) {
  const auto same = [&](const RehearsedKernel& known) {
    return &known.bindings->kernel().handles() == &bindings.kernel().handles();
  };
  auto known = std::ranges::find_if(rehearsed_, same);
  if (known == rehearsed_.end()) known = rehearsed_.insert(known, {.bindings = &bindings});
  known->invocations = std::max(known->invocations, invocations);
  ++known->dispatches;
}

void Recorder::beginStage(std::string_view stage) {
  if (!device_->executes()) return;
  assert(open_ && marks_.size() + 1 < kMaxTimestamps);
  mark();
  marks_.push_back(stage);
}

void Recorder::mark() {
  if (*handles_->timestamps)
    handles_->current().writeTimestamp(Stage::eBottomOfPipe, *handles_->timestamps,
                                       static_cast<std::uint32_t>(marks_.size()));
}

std::uint64_t Recorder::groupsPerDispatch(const Kernel& kernel, std::uint64_t work,
                                          std::uint64_t most) const {
  const std::uint64_t parallel = device_->limits().parallelWorkgroups;
  const auto within = [&](std::uint64_t limit, std::uint64_t each) {
    return std::max(limit, kLeastDispatch) / (kernel.workgroupSize() * each);
  };
  const std::uint64_t groups =
      std::min(within(sliceInvocations_, work), within(sliceMost_, std::max(most, work)));
  // The parts keep all processors of the device busy.
  return std::max(parallel, groups - groups % parallel);
}

bool Recorder::divides(const Bindings& bindings, std::uint64_t threads, std::uint64_t work) const {
  const Kernel& kernel = bindings.kernel();
  return work > 0 && threads > groupsPerDispatch(kernel, work) * kernel.workgroupSize();
}

void Recorder::dispatchBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                             std::uint64_t threads, std::uint64_t work, std::uint64_t most) {
  if (threads == 0) return;
  if (rehearses_) return note(bindings, threads);
  const Kernel& kernel = bindings.kernel();
  const std::uint64_t groups = (threads + kernel.workgroupSize() - 1) / kernel.workgroupSize();
  const std::uint32_t allowed = device_->limits().maxDispatchX;
  if (groups > allowed)
    throw std::runtime_error(fmt::format(
        "kernel {}: {} invocations are {} workgroups of {}, more than the {} that {} runs at once; make the "
        "workgroups larger or the invocations fewer",
        kernel.name(), threads, groups, kernel.workgroupSize(), allowed, device_->info().name));
  const std::uint64_t each = work == 0 ? groups : std::min(groups, groupsPerDispatch(kernel, work, most));
  for (std::uint64_t first = 0; first < groups; first += each) {
    const std::uint64_t now = std::min(each, groups - first);
    const std::uint64_t done = first * kernel.workgroupSize();
    const std::uint64_t invocations = std::min(now * kernel.workgroupSize(), threads - done);
    count(invocations * std::max<std::uint64_t>(work, 1), invocations * most);
    bind(bindings, push, pushBytes);
    // Synchronisation checks of the validation layer do not know vkCmdDispatchBase.
    if (first == 0)
      handles_->current().dispatch(static_cast<std::uint32_t>(now), 1, 1);
    else
      handles_->current().dispatchBase(static_cast<std::uint32_t>(first), 0, 0,
                                       static_cast<std::uint32_t>(now), 1, 1);
  }
}

void Recorder::dispatchIndirectBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                                     const Buffer& groups, std::size_t offset, std::uint64_t expected,
                                     std::uint64_t most) {
  assert(offset % 4 == 0 && offset + sizeof(VkDispatchIndirectCommand) <= groups.bytes());
  if (rehearses_) return note(bindings, std::max(expected, most));
  count(expected, most);
  waitBefore(sizeCommand);
  bind(bindings, push, pushBytes);
  handles_->current().dispatchIndirect(*groups.handles().buffer, offset);
}

void Recorder::touch(const Bindings& bindings) {
  const std::vector<std::byte> push(bindings.kernel().interface().pushConstantBytes);
  bind(bindings, push.data(), static_cast<std::uint32_t>(push.size()));
  handles_->current().dispatch(0, 1, 1);
}

void Recorder::bind(const Bindings& bindings, const void* push, std::uint32_t pushBytes) {
  const Kernel& kernel = bindings.kernel();
  assert(open_);
  if (pushBytes != kernel.interface().pushConstantBytes)
    throw std::logic_error(fmt::format("kernel {} has {} bytes of push constants and is given {}",
                                       kernel.name(), kernel.interface().pushConstantBytes, pushBytes));
  waitBefore(kernelCommand);
  handles_->current().bindPipeline(vk::PipelineBindPoint::eCompute, *kernel.handles().pipeline);
  if (*bindings.handles().set)
    handles_->current().bindDescriptorSets(vk::PipelineBindPoint::eCompute, *kernel.handles().layout, 0,
                                           *bindings.handles().set, nullptr);
  if (pushBytes > 0)
    handles_->current().pushConstants<std::byte>(*kernel.handles().layout, vk::ShaderStageFlagBits::eCompute,
                                                 0, {pushBytes, static_cast<const std::byte*>(push)});
}

void Recorder::barrier() {
  assert(open_);
  for (std::uint8_t& before : before_) before |= since_;
  since_ = 0;
}

void Recorder::waitBefore(Command command) {
  const std::uint8_t before = std::exchange(before_[command], std::uint8_t{0});
  since_ |= static_cast<std::uint8_t>(1u << command);
  if (before == 0) return;
  vk::PipelineStageFlags stages;
  vk::AccessFlags writes;
  for (std::uint32_t type = 0; type < kCommands; ++type) {
    if ((before >> type & 1u) == 0) continue;
    stages |= kAccess[type].stage;
    writes |= kAccess[type].writes;
  }
  const vk::MemoryBarrier memory{.srcAccessMask = writes, .dstAccessMask = kAccess[command].uses};
  handles_->current().pipelineBarrier(stages, kAccess[command].stage, {}, memory, nullptr, nullptr);
}

void Recorder::copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t fromOffset,
                    std::size_t toOffset) {
  assert(open_ && fromOffset + bytes <= from.bytes() && toOffset + bytes <= to.bytes());
  if (bytes == 0 || !device_->executes()) return;
  waitBefore(copyCommand);
  handles_->current().copyBuffer(
      *from.handles().buffer, *to.handles().buffer,
      vk::BufferCopy{.srcOffset = fromOffset, .dstOffset = toOffset, .size = bytes});
}

void Recorder::fill(const Buffer& buffer, std::uint32_t value, std::size_t bytes, std::size_t offset) {
  assert(open_ && bytes % 4 == 0 && offset % 4 == 0 && offset + bytes <= buffer.bytes());
  if (bytes == 0 || !device_->executes()) return;
  waitBefore(copyCommand);
  handles_->current().fillBuffer(*buffer.handles().buffer, offset, bytes, value);
}

void Recorder::finish() {
  if (!open_) return;
  assert(device_->executes());
  if (!marks_.empty()) mark();
  endSlice();
  open_ = false;
}

std::span<const StageTime> Recorder::stageTimes() {
  times_.clear();
  if (marks_.empty() || !*handles_->timestamps) return times_;
  const auto count = static_cast<std::uint32_t>(marks_.size() + 1);
  const VkResult result = device_->handles().device.getDispatcher()->vkGetQueryPoolResults(
      *device_->handles().device, *handles_->timestamps, 0, count, count * sizeof(std::uint64_t),
      ticks_.data(), sizeof(std::uint64_t), VK_QUERY_RESULT_64_BIT);
  if (result != VK_SUCCESS) return times_;
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    if (marks_[i] == kBetweenSlices) continue;
    const double seconds = static_cast<double>((ticks_[i + 1] - ticks_[i]) & timestampMask_) *
                           static_cast<double>(device_->limits().timestampPeriod) * 1e-9;
    const auto known = std::find_if(times_.begin(), times_.end(),
                                    [&](const StageTime& time) { return time.stage == marks_[i]; });
    if (known != times_.end()) {
      known->seconds += seconds;
    } else {
      assert(times_.size() < kMaxStages);
      times_.push_back({marks_[i], seconds});
    }
  }
  return times_;
}

}  // namespace clothstream::vulkan
