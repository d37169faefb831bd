// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace clothstream::vulkan {

// Commands of a command buffer.
struct CommandCounts {
  std::uint32_t dispatches = 0;
  std::uint32_t copies = 0;  // and fills
  std::uint32_t barriers = 0;
  bool operator==(const CommandCounts&) const = default;
};

}  // namespace clothstream::vulkan
