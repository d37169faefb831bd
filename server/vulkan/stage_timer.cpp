// SPDX-License-Identifier: MIT
#include "server/vulkan/stage_timer.h"

#include <algorithm>
#include <cassert>

#include "server/vulkan/handles.h"

namespace clothstream::vulkan {

StageTimer::StageTimer(const Device& device, std::uint32_t marks, std::uint32_t stages)
    : device_(&device), capacity_(marks), mostStages_(stages) {
  const Device::Handles& on = device.handles();
  const std::uint32_t bits = on.physical.getQueueFamilyProperties()[on.queueFamily].timestampValidBits;
  if (bits > 0)
    queries_ = vk::raii::QueryPool(
        on.device, vk::QueryPoolCreateInfo{.queryType = vk::QueryType::eTimestamp, .queryCount = marks});
  mask_ = bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  marks_.reserve(marks);
  ticks_.resize(marks);
  times_.reserve(stages);
}

void StageTimer::begin(const vk::raii::CommandBuffer& commands) {
  if (*queries_) commands.resetQueryPool(*queries_, 0, capacity_);
  marks_.clear();
}

void StageTimer::mark(const vk::raii::CommandBuffer& commands, std::string_view stage) {
  if (marks_.size() + 1 >= capacity_) return;
  write(commands);
  marks_.push_back(stage);
}

void StageTimer::end(const vk::raii::CommandBuffer& commands) {
  if (!marks_.empty()) write(commands);
}

void StageTimer::write(const vk::raii::CommandBuffer& commands) {
  if (*queries_)
    commands.writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *queries_,
                            static_cast<std::uint32_t>(marks_.size()));
}

std::span<const StageTime> StageTimer::times() {
  times_.clear();
  if (marks_.empty() || !*queries_) return times_;
  const auto count = static_cast<std::uint32_t>(marks_.size() + 1);
  const vk::raii::Device& vulkan = device_->handles().device;
  const VkResult result = vulkan.getDispatcher()->vkGetQueryPoolResults(
      *vulkan, *queries_, 0, count, count * sizeof(std::uint64_t), ticks_.data(), sizeof(std::uint64_t),
      VK_QUERY_RESULT_64_BIT);
  if (result != VK_SUCCESS) return times_;
  for (std::size_t i = 0; i < marks_.size(); ++i) {
    if (marks_[i] == kPause) continue;
    const double seconds = static_cast<double>((ticks_[i + 1] - ticks_[i]) & mask_) *
                           static_cast<double>(device_->limits().timestampPeriod) * 1e-9;
    const auto known = std::ranges::find(times_, marks_[i], &StageTime::stage);
    if (known != times_.end()) {
      known->seconds += seconds;
    } else {
      assert(times_.size() < mostStages_);
      times_.push_back({marks_[i], seconds});
    }
  }
  return times_;
}

}  // namespace clothstream::vulkan
