// SPDX-License-Identifier: MIT
// Suite kernels: what the driver's compiler says about each kernel, and bounds on named GPUs. Nothing runs.
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "tests/bench/suite.h"
#include "tests/kernel_survey/roofline.h"
#include "tests/kernel_survey/survey.h"
#include "tests/kernel_survey/survey_scenes.h"

namespace clothstream::bench {
namespace {

constexpr const char* kUntold = "untold";

nlohmann::ordered_json numberOf(double value) {
  if (value == std::floor(value)) return static_cast<std::int64_t>(value);
  return value;
}

nlohmann::ordered_json numberOf(const std::optional<double>& value) {
  return value ? numberOf(*value) : nlohmann::ordered_json(kUntold);
}

}  // namespace

void runKernels(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const simulation::SimulationOptions options{.rowsPerInvocation = settings.rowsPerInvocation,
                                              .workgroupSize = settings.workgroupSize,
                                              .xpbdWholeNodes = settings.xpbdWholeNodes,
                                              .solveWholeNodes = settings.solveWholeNodes};
  for (const kernel_survey::SurveyedKernel& kernel :
       kernel_survey::survey(device, kernel_survey::surveyScenes(), options)) {
    nlohmann::ordered_json row{{"suite", "kernels"},          {"kernel", kernel.kernel},
                               {"settings", kernel.settings}, {"workgroup", kernel.workgroupSize},
                               {"scenes", kernel.scenes},     {"first_scene", kernel.firstScene}};
    if (kernel.statistics.empty()) row["compiler"] = kUntold;
    for (const vulkan::KernelStatistic& statistic : kernel.statistics)
      row[statistic.name] = numberOf(statistic.value);
    row["bytes_per_node"] = numberOf(kernel.bytesPerNode);
    row["lane_cycles_per_node"] = numberOf(kernel_survey::laneCyclesPerNode(kernel));
    for (const kernel_survey::Gpu& gpu : kernel_survey::namedGpus()) {
      const std::optional<double> bound = kernel_survey::boundPerNode(kernel, gpu);
      row[fmt::format("at least ps a node, {}", gpu.name)] =
          numberOf(bound ? std::optional(*bound * 1e12) : bound);
    }
    add(row);
  }
}

}  // namespace clothstream::bench
