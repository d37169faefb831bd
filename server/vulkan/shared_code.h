// SPDX-License-Identifier: MIT
#pragma once
#include <cstdint>
#include <span>
#include <vector>
namespace clothstream::vulkan {
std::vector<std::uint32_t> sharedCode(std::span<const std::uint32_t> spirv);
}
