// SPDX-License-Identifier: MIT
// Records work for the device: bind, push, dispatch, copy, barrier, timestamp.
#include "server/vulkan/recorder.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "server/vulkan/command_writer.h"
#include "server/vulkan/handles.h"

namespace clothstream::vulkan {
namespace {

// Timestamps of a recording: one before each stage and one at the end, and two between slices.
constexpr std::uint32_t kMaxTimestamps = Recorder::kMaxMarks + 1 + 2 * Recorder::kMaxTimedSlices;

// Least work of a dispatch that shares a larger one. A dispatch costs a software device up to 0.1 ms, and
// this work about 1 ms.
constexpr std::uint64_t kLeastDispatch = 1 << 16;

}  // namespace

Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;

Recorder::Recorder(const Device& device) : device_(&device), handles_(std::make_unique<Handles>()) {
  if (!device.executes()) return;
  handles_->pool = vk::raii::CommandPool(
      device.handles().device, vk::CommandPoolCreateInfo{.queueFamilyIndex = device.handles().queueFamily});
  times_.reserve(kMaxStages);
}

void Recorder::begin() {
  open_ = true;
  recording_.clear();
  rehearses_ = !device_->executes();
  if (rehearses_) return rehearsed_.clear();
  slices_ = 1;
  invocations_ = most_ = work_ = largestDispatch_ = mostOfDispatch_ = 0;
  marks_ = timedSlices_ = 0;
  stage_ = {};
}

void Recorder::startSlice() {
  recording_.add(SliceStart{});
  ++slices_;
  invocations_ = most_ = 0;
}

void Recorder::count(std::uint64_t invocations, std::uint64_t most) {
  most = std::max(most, invocations);
  if (most_ > 0 && (invocations_ + invocations > sliceInvocations_ || most_ + most > sliceMost_)) {
    if (marks_ == 0 || timedSlices_ == kMaxTimedSlices) {
      startSlice();
    } else {
      recording_.add(StageStart{StageTimer::kPause});
      startSlice();
      recording_.add(StageStart{stage_});
      ++timedSlices_;
    }
  }
  invocations_ += invocations;
  most_ += most;
  work_ += invocations;
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
  assert(open_ && marks_ < kMaxMarks);
  stage_ = stage;
  ++marks_;
  recording_.add(StageStart{stage});
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
  const PushRange range = notePush(kernel, push, pushBytes);
  const std::uint64_t each = work == 0 ? groups : std::min(groups, groupsPerDispatch(kernel, work, most));
  for (std::uint64_t first = 0; first < groups; first += each) {
    const std::uint64_t now = std::min(each, groups - first);
    const std::uint64_t done = first * kernel.workgroupSize();
    const std::uint64_t invocations = std::min(now * kernel.workgroupSize(), threads - done);
    count(invocations * std::max<std::uint64_t>(work, 1), invocations * most);
    recording_.add(Dispatch{.kernel = &kernel.handles(),
                            .bindings = &bindings.handles(),
                            .push = range,
                            .firstGroup = static_cast<std::uint32_t>(first),
                            .groups = static_cast<std::uint32_t>(now)});
  }
}

void Recorder::dispatchIndirectBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                                     const Buffer& groups, std::size_t offset, std::uint64_t expected,
                                     std::uint64_t most) {
  assert(offset % 4 == 0 && offset + sizeof(VkDispatchIndirectCommand) <= groups.bytes());
  if (rehearses_) return note(bindings, std::max(expected, most));
  count(expected, most);
  recording_.add(IndirectDispatch{.kernel = &bindings.kernel().handles(),
                                  .bindings = &bindings.handles(),
                                  .push = notePush(bindings.kernel(), push, pushBytes),
                                  .sizes = &groups.handles(),
                                  .offset = offset});
}

void Recorder::touch(const Bindings& bindings) {
  const std::vector<std::byte> push(bindings.kernel().interface().pushConstantBytes);
  recording_.add(
      Touch{.kernel = &bindings.kernel().handles(),
            .bindings = &bindings.handles(),
            .push = notePush(bindings.kernel(), push.data(), static_cast<std::uint32_t>(push.size()))});
}

PushRange Recorder::notePush(const Kernel& kernel, const void* push, std::uint32_t pushBytes) {
  assert(open_);
  if (pushBytes != kernel.interface().pushConstantBytes)
    throw std::logic_error(fmt::format("kernel {} has {} bytes of push constants and is given {}",
                                       kernel.name(), kernel.interface().pushConstantBytes, pushBytes));
  return recording_.addPush({static_cast<const std::byte*>(push), pushBytes});
}

void Recorder::barrier() {
  assert(open_);
  recording_.add(Barrier{});
}

void Recorder::copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t fromOffset,
                    std::size_t toOffset) {
  assert(open_ && fromOffset + bytes <= from.bytes() && toOffset + bytes <= to.bytes());
  if (bytes == 0 || !device_->executes()) return;
  recording_.add(Copy{.from = &from.handles(),
                      .to = &to.handles(),
                      .fromOffset = fromOffset,
                      .toOffset = toOffset,
                      .bytes = bytes});
}

void Recorder::fill(const Buffer& buffer, std::uint32_t value, std::size_t bytes, std::size_t offset) {
  assert(open_ && bytes % 4 == 0 && offset % 4 == 0 && offset + bytes <= buffer.bytes());
  if (bytes == 0 || !device_->executes()) return;
  recording_.add(Fill{.buffer = &buffer.handles(), .offset = offset, .bytes = bytes, .value = value});
}

void Recorder::finish() {
  if (!open_) return;
  assert(device_->executes());
  open_ = inBatch_ = false;
  Handles& on = *handles_;
  if (marks_ > 0 && !on.timer) on.timer.emplace(*device_, kMaxTimestamps, kMaxStages);
  on.pool.reset();
  while (on.slices.size() < slices_) {
    vk::raii::CommandBuffers all(
        device_->handles().device,
        vk::CommandBufferAllocateInfo{
            .commandPool = *on.pool, .level = vk::CommandBufferLevel::ePrimary, .commandBufferCount = 1});
    on.slices.push_back(std::move(all.front()));
  }
  std::uint32_t slice = 0;
  CommandWriter writer;
  writer.begin(on.slices[slice]);
  if (on.timer) on.timer->begin(writer.commands());
  for (const Command& command : recording_.commands()) {
    if (const auto* stage = std::get_if<StageStart>(&command)) {
      on.timer->mark(writer.commands(), stage->name);
    } else if (std::holds_alternative<SliceStart>(command)) {
      writer.end();
      writer.begin(on.slices[++slice]);
    } else {
      writer.write(command, recording_);
    }
  }
  if (on.timer) on.timer->end(writer.commands());
  writer.end();
}

const Recording& Recorder::endForBatch() {
  assert(open_ && !rehearses_ && slices_ == 1);
  open_ = false;
  inBatch_ = true;
  times_.clear();
  return recording_;
}

void Recorder::setStageTimes(std::span<const StageTime> batch, double part) {
  times_.clear();
  for (const StageTime& time : batch) times_.push_back({time.stage, part * time.seconds});
}

std::span<const StageTime> Recorder::stageTimes() {
  if (inBatch_) return times_;
  return handles_->timer ? handles_->timer->times() : std::span<const StageTime>();
}

}  // namespace clothstream::vulkan
