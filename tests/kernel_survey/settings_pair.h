// SPDX-License-Identifier: MIT
// A scene that runs twice: with the settings of kernels for CPUs, and with those for GPUs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "server/vulkan/device.h"
#include "tests/simulation/scenes.h"

namespace clothstream::kernel_survey {

class SettingsPair {
 public:
  explicit SettingsPair(const model::Scene& scene)
      : scene_(scene),
        cpuDevice_({.kernels = vulkan::KernelSettings::cpu}),
        gpuDevice_({.kernels = vulkan::KernelSettings::gpu}),
        cpu_(scene, {}, cpuDevice_),
        gpu_(scene, {}, gpuDevice_) {}

  const model::Scene& scene() const { return scene_; }
  tests::Running& cpu() { return cpu_; }
  tests::Running& gpu() { return gpu_; }

  // Runs a tick with a report on both. Expects the same states and the same reports of the solves.
  void expectSameTick(const simulation::TickInputs& inputs, int tick) {
    SCOPED_TRACE(::testing::Message() << scene_.name << ", tick " << tick);
    const simulation::TickStatus cpu = cpu_.tick(inputs), gpu = gpu_.tick(inputs);
    EXPECT_TRUE(cpu.healthy);
    EXPECT_EQ(gpu.healthy, cpu.healthy);
    EXPECT_EQ(gpu.stateHash, cpu.stateHash);
    const std::vector<shared::SolveRecord> ofCpu = cpu_.solves(), ofGpu = gpu_.solves();
    std::vector<std::uint32_t> iterations, others;
    for (const shared::SolveRecord& solve : ofCpu) iterations.push_back(solve.iterations);
    for (const shared::SolveRecord& solve : ofGpu) others.push_back(solve.iterations);
    std::ranges::sort(iterations);
    std::ranges::sort(others);
    EXPECT_EQ(others, iterations);  // the order of the systems follows their sizes
  }

 private:
  model::Scene scene_;
  vulkan::Device cpuDevice_, gpuDevice_;
  tests::Running cpu_, gpu_;
};

}  // namespace clothstream::kernel_survey
