// SPDX-License-Identifier: MIT
// What the driver's compiler says about a kernel.
#pragma once

#include <string>
#include <vector>

#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"

namespace clothstream::vulkan {

// Names, meanings and units are the driver's.
struct KernelStatistic {
  std::string name;         // such as "VGPRs"
  std::string description;  // one sentence
  double value = 0;
};

// Statistics of a kernel that was created on a device that only compiles (DeviceOptions::compileOnly). Empty
// if the device executes, or if its driver does not offer VK_KHR_pipeline_executable_properties. Throws
// std::runtime_error, which names the kernel, if the driver fails.
std::vector<KernelStatistic> statisticsOf(const Device& device, const Kernel& kernel);

// Invocations that run in lockstep in this kernel, as the driver reports it. 0 if the statistics are empty.
std::uint32_t subgroupSizeOf(const Device& device, const Kernel& kernel);

}  // namespace clothstream::vulkan
