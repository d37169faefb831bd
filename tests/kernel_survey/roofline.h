// SPDX-License-Identifier: MIT
// Lower bound of a kernel's time on GPUs, from their public figures.
#pragma once

#include <optional>
#include <span>

#include "tests/kernel_survey/survey.h"

namespace clothstream::kernel_survey {

struct Gpu {
  const char* name;
  double bytesPerSecond;  // of its memory
  double flops;           // float32, where a fused multiply-add counts as two
};

// docs/gpu-kernels.md has the sources of the figures.
std::span<const Gpu> namedGpus();

// Float32 lanes that are busy for a node, times cycles, as the compiler estimates them for its own GPU.
// Absent if the driver gives no estimate, or if one workgroup works on a whole cloth.
std::optional<double> laneCyclesPerNode(const SurveyedKernel& kernel);

// Seconds a node and dispatch that the kernel takes at least: the larger of the times that its bytes and its
// lane cycles take. Caches that keep a whole cloth are faster than the first. Absent if the bytes are.
std::optional<double> boundPerNode(const SurveyedKernel& kernel, const Gpu& gpu);

}  // namespace clothstream::kernel_survey
