// SPDX-License-Identifier: MIT
// Measures the stages of a submission by timestamps of the device.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/device.h"
#include "server/vulkan/stage_time.h"

namespace clothstream::vulkan {

// Only for this folder, like handles.h.
class StageTimer {
 public:
  // Time of this stage, which has no name, is left out.
  static constexpr std::string_view kPause = {};

  // `marks`: the most calls of mark() and end() in a submission. `stages`: the most names.
  StageTimer(const Device& device, std::uint32_t marks, std::uint32_t stages);

  // Begins a submission. The earlier one must be complete.
  void begin(const vk::raii::CommandBuffer& commands);
  // Later commands count towards this stage. Marks beyond the limit are left out.
  void mark(const vk::raii::CommandBuffer& commands, std::string_view stage);
  void end(const vk::raii::CommandBuffer& commands);

  // Times of the complete submission, in the order of first appearance. Empty if the device has no
  // timestamps. Valid until the next call or begin().
  std::span<const StageTime> times();

 private:
  void write(const vk::raii::CommandBuffer& commands);

  const Device* device_;
  vk::raii::QueryPool queries_ = nullptr;
  std::uint64_t mask_ = 0;
  std::uint32_t capacity_, mostStages_;
  std::vector<std::string_view> marks_;  // stage that each timestamp begins
  std::vector<std::uint64_t> ticks_;
  std::vector<StageTime> times_;
};

}  // namespace clothstream::vulkan
