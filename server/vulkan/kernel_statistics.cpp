// SPDX-License-Identifier: MIT
// What the driver's compiler says about a kernel.
#include "server/vulkan/kernel_statistics.h"

#include <stdexcept>

#include <fmt/format.h>

#include "server/vulkan/handles.h"

namespace clothstream::vulkan {
namespace {

double valueOf(const vk::PipelineExecutableStatisticKHR& statistic) {
  switch (statistic.format) {
    case vk::PipelineExecutableStatisticFormatKHR::eBool32:
      return statistic.value.b32 != VK_FALSE ? 1 : 0;
    case vk::PipelineExecutableStatisticFormatKHR::eInt64:
      return static_cast<double>(statistic.value.i64);
    case vk::PipelineExecutableStatisticFormatKHR::eUint64:
      return static_cast<double>(statistic.value.u64);
    case vk::PipelineExecutableStatisticFormatKHR::eFloat64:
      break;
  }
  return statistic.value.f64;
}

std::vector<vk::PipelineExecutablePropertiesKHR> executablesOf(const Device& device, const Kernel& kernel) {
  if (!device.handles().keepsStatistics) return {};
  try {
    return device.handles().device.getPipelineExecutablePropertiesKHR(
        vk::PipelineInfoKHR{.pipeline = *kernel.handles().pipeline});
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(fmt::format("{} has no statistics of the kernel {}: {}", device.info().name,
                                         kernel.name(), error.what()));
  }
}

}  // namespace

std::vector<KernelStatistic> statisticsOf(const Device& device, const Kernel& kernel) {
  std::vector<KernelStatistic> all;
  const auto executables = static_cast<std::uint32_t>(executablesOf(device, kernel).size());
  for (std::uint32_t i = 0; i < executables; ++i)
    for (const vk::PipelineExecutableStatisticKHR& statistic :
         device.handles().device.getPipelineExecutableStatisticsKHR(
             {.pipeline = *kernel.handles().pipeline, .executableIndex = i}))
      all.push_back({statistic.name.data(), statistic.description.data(), valueOf(statistic)});
  return all;
}

std::uint32_t subgroupSizeOf(const Device& device, const Kernel& kernel) {
  const std::vector<vk::PipelineExecutablePropertiesKHR> executables = executablesOf(device, kernel);
  return executables.empty() ? 0 : executables.front().subgroupSize;
}

}  // namespace clothstream::vulkan
