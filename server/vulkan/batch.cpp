// SPDX-License-Identifier: MIT
#include "server/vulkan/batch.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <functional>
#include <variant>

#include "kernels/move_words.h"
#include "server/vulkan/batch_handles.h"

namespace clothstream::vulkan {
namespace {

constexpr std::uint32_t kWordBytes = sizeof(std::uint32_t);
constexpr std::uint32_t kMoveWorkgroup = 64;

// Push constants of the kernel move_words.
struct MovePush {
  std::uint32_t firstFrom = 0, firstTo = 0;  // words
  std::uint32_t words = 0;
  std::uint32_t fills = 0;  // not 0: each word becomes `value`
  std::uint32_t value = 0;
};

// A copy or a fill as that kernel does it.
struct Move {
  std::array<BoundBufferAddress, 2> buffers;  // from, to
  MovePush push;
};

Move moveOf(const Copy& copy) {
  return {{BoundBufferAddress{copy.from, copy.fromOffset + copy.bytes},
           BoundBufferAddress{copy.to, copy.toOffset + copy.bytes}},
          {.firstFrom = static_cast<std::uint32_t>(copy.fromOffset / kWordBytes),
           .firstTo = static_cast<std::uint32_t>(copy.toOffset / kWordBytes),
           .words = static_cast<std::uint32_t>(copy.bytes / kWordBytes),
           .fills = 0,
           .value = 0}};
}

Move moveOf(const Fill& fill) {
  const BoundBufferAddress to{fill.buffer, fill.offset + fill.bytes};
  return {{to, to},
          {.firstFrom = 0,
           .firstTo = static_cast<std::uint32_t>(fill.offset / kWordBytes),
           .words = static_cast<std::uint32_t>(fill.bytes / kWordBytes),
           .fills = 1,
           .value = fill.value}};
}

bool hasWholeWords(const Command& command) {
  const auto* copy = std::get_if<Copy>(&command);
  return copy == nullptr || (copy->bytes | copy->fromOffset | copy->toOffset) % kWordBytes == 0;
}

bool isBetweenLevels(const Command& command) {
  return std::holds_alternative<Barrier>(command) || std::holds_alternative<StageStart>(command);
}

}  // namespace

Batch::Batch(const Device& device) : device_(&device), handles_(std::make_unique<Handles>(device)) {
  Handles& on = *handles_;
  on.pool = vk::raii::CommandPool(
      device.handles().device, vk::CommandPoolCreateInfo{.queueFamilyIndex = device.handles().queueFamily});
  on.commands = vk::raii::CommandBuffers(
      device.handles().device,
      vk::CommandBufferAllocateInfo{
          .commandPool = *on.pool, .level = vk::CommandBufferLevel::ePrimary, .commandBufferCount = 2});
  if (device.sharesKernels()) on.moveWords.emplace(device, kernels::move_words, kMoveWorkgroup);
}

Batch::~Batch() = default;

void Batch::begin() {
  members_.clear();
}

void Batch::add(Recorder& recorder) {
  members_.push_back({&recorder, &recorder.endForBatch()});
}

std::uint64_t Batch::work() const {
  std::uint64_t work = 0;
  for (const Member& member : members_) work += member.recorder->work();
  return work;
}

void Batch::shareTimes() {
  const std::span<const StageTime> times = handles_->timer.times();
  const auto all = static_cast<double>(work());
  for (const Member& member : members_)
    member.recorder->setStageTimes(times, all > 0 ? static_cast<double>(member.recorder->work()) / all : 0);
}

const CommandCounts& Batch::counts() const {
  return handles_->writer.counts();
}

void Batch::findGroups() {
  const auto shapeOf = [](const Member& member) {
    return std::pair(member.recording->shape(), member.recording->commands().size());
  };
  std::ranges::sort(members_, {}, shapeOf);
  groups_.clear();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (i == 0 || shapeOf(members_[i]) != shapeOf(members_[i - 1])) groups_.push_back({.first = i});
    ++groups_.back().count;
  }
  // The first group's stages are timed.
  std::ranges::stable_sort(groups_, std::ranges::greater{}, &Group::count);
}

void Batch::finish() {
  Handles& on = *handles_;
  findGroups();
  while (!write()) on.table.grow();
  on.submitted.clear();
  if (on.table.bytes() > 0) {
    CommandWriter upload;
    upload.begin(on.commands[0]);
    upload.copy(on.table.staging(), on.table.onDevice(), {.size = on.table.bytes()});
    upload.end();
    on.submitted.push_back(*on.commands[0]);
  }
  on.submitted.push_back(*on.commands[1]);
}

bool Batch::write() {
  Handles& on = *handles_;
  on.pool.reset();
  on.table.begin();
  on.writer.begin(on.commands[1]);
  on.timer.begin(on.writer.commands());
  for (Group& group : groups_) group.next = 0;
  for (bool goesOn = true; goesOn;) {
    goesOn = false;
    for (Group& group : groups_) goesOn = writeLevel(group, &group == &groups_.front()) || goesOn;
    on.writer.barrier();
  }
  on.timer.end(on.writer.commands());
  on.writer.end();
  return on.table.isComplete();
}

bool Batch::writeLevel(Group& group, bool times) {
  const std::span<const Command> commands = members_[group.first].recording->commands();
  bool works = false;  // this level has commands
  for (; group.next < commands.size(); ++group.next) {
    const Command& command = commands[group.next];
    if (const auto* stage = std::get_if<StageStart>(&command); stage != nullptr && times)
      handles_->timer.mark(handles_->writer.commands(), stage->name);
    if (std::holds_alternative<Barrier>(command) && works) break;
    if (isBetweenLevels(command)) continue;
    works = true;
    writeCommand(group, group.next);
  }
  return group.next < commands.size();
}

void Batch::writeCommand(const Group& group, std::size_t command) {
  if (group.count > 1 && device_->sharesKernels() &&
      (shareDispatch(group, command) || shareMove(group, command)))
    return;
  for (std::size_t i = 0; i < group.count; ++i) {
    const Recording& recording = *members_[group.first + i].recording;
    handles_->writer.write(recording.commands()[command], recording);
  }
}

template <typename One>
const One& Batch::commandOf(std::size_t member, std::size_t command) const {
  return std::get<One>(members_[member].recording->commands()[command]);
}

bool Batch::shareDispatch(const Group& group, std::size_t command) {
  const auto* first = std::get_if<Dispatch>(&members_[group.first].recording->commands()[command]);
  if (first == nullptr || first->firstGroup > 0) return false;
  BatchTable& table = handles_->table;
  const BatchTable::Entries entries = table.entries(group.count);
  std::uint32_t groups = 0;
  for (std::size_t i = 0; i < group.count; ++i) {
    const auto& dispatch = commandOf<Dispatch>(group.first + i, command);
    assert(dispatch.kernel == first->kernel && dispatch.firstGroup == 0);
    const std::span<const std::byte> push = members_[group.first + i].recording->push(dispatch.push);
    table.set(
        entries, i,
        {.record = table.record(*dispatch.bindings), .push = table.push(push), .groups = dispatch.groups});
    groups = std::max(groups, dispatch.groups);
  }
  handles_->writer.dispatchShared(*first->kernel, entries.address, groups,
                                  static_cast<std::uint32_t>(group.count));
  return true;
}

bool Batch::shareMove(const Group& group, std::size_t command) {
  const auto commandAt = [&](std::size_t i) -> const Command& {
    return members_[group.first + i].recording->commands()[command];
  };
  if (!std::holds_alternative<Copy>(commandAt(0)) && !std::holds_alternative<Fill>(commandAt(0)))
    return false;
  for (std::size_t i = 0; i < group.count; ++i)
    if (!hasWholeWords(commandAt(i))) return false;
  BatchTable& table = handles_->table;
  const BatchTable::Entries entries = table.entries(group.count);
  std::uint32_t groups = 0;
  for (std::size_t i = 0; i < group.count; ++i) {
    const auto* copy = std::get_if<Copy>(&commandAt(i));
    const Move move = copy != nullptr ? moveOf(*copy) : moveOf(std::get<Fill>(commandAt(i)));
    const std::uint32_t own = (move.push.words + kMoveWorkgroup - 1) / kMoveWorkgroup;
    table.set(entries, i,
              {.record = table.record(move.buffers),
               .push = table.push(std::as_bytes(std::span(&move.push, 1))),
               .groups = own});
    groups = std::max(groups, own);
  }
  handles_->writer.dispatchShared(handles_->moveWords->handles(), entries.address, groups,
                                  static_cast<std::uint32_t>(group.count));
  return true;
}

}  // namespace clothstream::vulkan
