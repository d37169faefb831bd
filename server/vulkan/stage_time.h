// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace clothstream::vulkan {

// Time of the device in a stage.
struct StageTime {
  std::string_view stage;  // the name passed to Recorder::beginStage; static storage
  double seconds = 0;
};

}  // namespace clothstream::vulkan
