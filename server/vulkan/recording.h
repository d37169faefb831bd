// SPDX-License-Identifier: MIT
// Commands of a recording as data, before they become commands of the device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/kernel.h"

namespace clothstream::vulkan {

// Where the push constants of a command are in Recording::pushes.
struct PushRange {
  std::uint32_t offset = 0, bytes = 0;
};

// The objects that commands refer to have to exist until the recording is complete on the device.
struct Dispatch {
  const Kernel::Handles* kernel = nullptr;
  const Bindings::Handles* bindings = nullptr;
  PushRange push;
  std::uint32_t firstGroup = 0, groups = 0;  // workgroups in x
};

struct IndirectDispatch {
  const Kernel::Handles* kernel = nullptr;
  const Bindings::Handles* bindings = nullptr;
  PushRange push;
  const Buffer::Handles* sizes = nullptr;
  std::uint64_t offset = 0;
};

struct Copy {
  const Buffer::Handles *from = nullptr, *to = nullptr;
  std::uint64_t fromOffset = 0, toOffset = 0, bytes = 0;
};

struct Fill {
  const Buffer::Handles* buffer = nullptr;
  std::uint64_t offset = 0, bytes = 0;
  std::uint32_t value = 0;
};

// Runs a kernel in all of its forms on no data.
struct Touch {
  const Kernel::Handles* kernel = nullptr;
  const Bindings::Handles* bindings = nullptr;
  PushRange push;
};

// Later commands see the work of earlier ones. Commands between two barriers are independent.
struct Barrier {};

struct StageStart {
  std::string_view name;  // static storage
};

struct SliceStart {};

using Command = std::variant<Dispatch, IndirectDispatch, Copy, Fill, Touch, Barrier, StageStart, SliceStart>;

class Recording {
 public:
  void clear() {
    commands_.clear();
    pushes_.clear();
    shape_ = kNoShape;
  }
  void add(const Command& command);
  PushRange addPush(std::span<const std::byte> push);

  std::span<const Command> commands() const { return commands_; }
  std::span<const std::byte> push(PushRange range) const {
    return std::span(pushes_).subspan(range.offset, range.bytes);
  }
  // Bytes of all push constants.
  std::size_t pushBytes() const { return pushes_.size(); }
  // Hash of the types of the commands, their kernels, and the magnitude of their dispatches. Recordings with
  // the same shape do the same for other data.
  std::uint64_t shape() const { return shape_; }

 private:
  static constexpr std::uint64_t kNoShape = 0xcbf29ce484222325u;

  std::vector<Command> commands_;
  std::vector<std::byte> pushes_;
  std::uint64_t shape_ = kNoShape;
};

}  // namespace clothstream::vulkan
