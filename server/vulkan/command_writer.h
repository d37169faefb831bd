// SPDX-License-Identifier: MIT
// Writes recorded commands into a command buffer, with the barriers that they need.
#pragma once

#include <array>
#include <cstdint>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/command_counts.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recording.h"

namespace clothstream::vulkan {

// Only for this folder, like handles.h.
class CommandWriter {
 public:
  // Begins the command buffer.
  void begin(const vk::raii::CommandBuffer& commands);
  // Ends it with a barrier towards the host and later submissions.
  void end();

  // Writes any command but StageStart and SliceStart. The recording has its push constants.
  void write(const Command& command, const Recording& recording);
  // Runs the shared form of the kernel for `count` entries at `entries`, with this number of workgroups for
  // each (shared_code.h).
  void dispatchShared(const Kernel::Handles& kernel, vk::DeviceAddress entries, std::uint32_t groups,
                      std::uint32_t count);
  void copy(vk::Buffer from, vk::Buffer to, const vk::BufferCopy& range);
  // Later commands see the work of earlier ones. The device waits when a later command needs it, and only for
  // the types of commands that there were: between kernels alone, a GPU need not wait for copies and dispatch
  // sizes.
  void barrier();

  const vk::raii::CommandBuffer& commands() const { return *commands_; }
  // Commands since begin().
  const CommandCounts& counts() const { return counts_; }

 private:
  void writeOne(const Dispatch& dispatch, const Recording& recording);
  void writeOne(const IndirectDispatch& dispatch, const Recording& recording);
  void writeOne(const Copy& copy, const Recording& recording);
  void writeOne(const Fill& fill, const Recording& recording);
  void writeOne(const Touch& touch, const Recording& recording);
  void writeOne(const Barrier&, const Recording&) { barrier(); }
  void writeOne(const StageStart&, const Recording&) {}
  void writeOne(const SliceStart&, const Recording&) {}

  void bind(const Kernel::Handles& kernel, const Bindings::Handles& bindings, PushRange push,
            const Recording& recording);
  // Commands as barriers distinguish them. An indirect dispatch is a kernel and also reads its size.
  enum Type : std::uint8_t { kernelCommand, copyCommand, sizeCommand, kTypes };
  // Writes the barrier that a command of this type needs, if any.
  void waitBefore(Type type);

  const vk::raii::CommandBuffer* commands_ = nullptr;
  CommandCounts counts_;
  // Types of the commands since the last call of barrier(), and of those before it that a command of a type
  // has not waited for, as bits.
  std::uint8_t since_ = 0;
  std::array<std::uint8_t, kTypes> before_{};
};

}  // namespace clothstream::vulkan
