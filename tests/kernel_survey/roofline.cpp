// SPDX-License-Identifier: MIT
// Lower bound of a kernel's time on GPUs, from their public figures.
#include "tests/kernel_survey/roofline.h"

#include <algorithm>

namespace clothstream::kernel_survey {
namespace {

constexpr Gpu kGpus[] = {{"RX 6800 (NAVI21)", 512e9, 16.17e12},
                         {"RX 7900 XTX (NAVI31)", 960e9, 61.4e12},
                         {"RTX 4090", 1008e9, 82.6e12},
                         {"H100 SXM", 3350e9, 67e12}};

// Lanes of a SIMD unit of RDNA, for which RADV estimates cycles.
constexpr double kLanes = 32;

}  // namespace

std::span<const Gpu> namedGpus() {
  return kGpus;
}

std::optional<double> laneCyclesPerNode(const SurveyedKernel& kernel) {
  const std::optional<double> cycles = kernel.statistic("Inverse Throughput");
  if (!cycles || !kernel.invocationsPerNode || kernel.subgroupSize == 0) return std::nullopt;
  return *cycles * kLanes * *kernel.invocationsPerNode / kernel.subgroupSize;
}

std::optional<double> boundPerNode(const SurveyedKernel& kernel, const Gpu& gpu) {
  if (!kernel.bytesPerNode) return std::nullopt;
  // A lane completes one operation a cycle, which peak figures count as two.
  const double arithmetic = laneCyclesPerNode(kernel).value_or(0) * 2 / gpu.flops;
  return std::max(*kernel.bytesPerNode / gpu.bytesPerSecond, arithmetic);
}

}  // namespace clothstream::kernel_survey
