// SPDX-License-Identifier: MIT
#include "server/vulkan/recording.h"

#include <bit>

namespace clothstream::vulkan {
namespace {

std::uint64_t partOfShape(const Command& command) {
  if (const auto* dispatch = std::get_if<Dispatch>(&command))
    return reinterpret_cast<std::uintptr_t>(dispatch->kernel) +
           static_cast<std::uint64_t>(std::bit_width(dispatch->groups)) + (dispatch->firstGroup > 0 ? 64 : 0);
  if (const auto* dispatch = std::get_if<IndirectDispatch>(&command))
    return reinterpret_cast<std::uintptr_t>(dispatch->kernel);
  return 0;
}

// Finaliser of splitmix64, so that each bit of `value` changes all bits of the result.
std::uint64_t mixed(std::uint64_t value) {
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
  return value ^ (value >> 31);
}

}  // namespace

void Recording::add(const Command& command) {
  commands_.push_back(command);
  shape_ = mixed(shape_ + command.index() + 1) ^ mixed(partOfShape(command));
}

PushRange Recording::addPush(std::span<const std::byte> push) {
  const PushRange range{static_cast<std::uint32_t>(pushes_.size()), static_cast<std::uint32_t>(push.size())};
  pushes_.insert(pushes_.end(), push.begin(), push.end());
  return range;
}

}  // namespace clothstream::vulkan
