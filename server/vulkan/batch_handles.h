// SPDX-License-Identifier: MIT
// The Vulkan objects of a batch.
#pragma once

#include <optional>
#include <vector>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/batch.h"
#include "server/vulkan/batch_table.h"
#include "server/vulkan/command_writer.h"
#include "server/vulkan/handles.h"
#include "server/vulkan/stage_timer.h"

namespace clothstream::vulkan {

struct Batch::Handles {
  explicit Handles(const Device& device)
      : timer(device, Recorder::kMaxMarks + 1, Recorder::kMaxStages), table(device) {}

  vk::raii::CommandPool pool = nullptr;
  std::vector<vk::raii::CommandBuffer> commands;  // upload of the table, then the work
  std::vector<vk::CommandBuffer> submitted;
  CommandWriter writer;
  StageTimer timer;
  BatchTable table;
  std::optional<Kernel> moveWords;  // if the device shares kernels
};

}  // namespace clothstream::vulkan
