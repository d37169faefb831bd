// SPDX-License-Identifier: MIT
// A scene that runs twice: with the settings of kernels for CPUs, and with those for GPUs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::kernel_survey {

class SettingsPair {
 public:
  explicit SettingsPair(const model::Scene& scene)
      : scene_(scene), cpu_(scene, vulkan::KernelSettings::cpu), gpu_(scene, vulkan::KernelSettings::gpu) {}

  const model::Scene& scene() const { return scene_; }

  // Runs a tick on both. Expects the same states, and the same iterations of the solves.
  void expectSameTick(const simulation::TickInputs& inputs, int tick) {
    SCOPED_TRACE(::testing::Message() << scene_.name << ", tick " << tick);
    for (Side* side : {&cpu_, &gpu_}) side->run([&] { side->simulation.recordTick(side->recorder, inputs); });
    EXPECT_TRUE(cpu_.simulation.status().healthy);
    EXPECT_EQ(gpu_.simulation.status().healthy, cpu_.simulation.status().healthy);
    EXPECT_EQ(gpu_.simulation.status().stateHash, cpu_.simulation.status().stateHash);
    EXPECT_EQ(gpu_.solves(), cpu_.solves());
  }

  void expectSameNormals() { EXPECT_EQ(gpu_.normals(), cpu_.normals()); }

 private:
  struct Side {
    Side(const model::Scene& scene, vulkan::KernelSettings kernels)
        : device({.kernels = kernels}), recorder(device), simulation(device, scene) {}

    // Runs until it is complete. The device may compile kernels meanwhile.
    void run(const std::function<void()>& record) {
      recorder.begin();
      record();
      device.wait(device.submit(recorder));
    }

    // Iterations and active constraints of the solves, sorted: the order of the systems follows their sizes.
    std::vector<std::tuple<std::uint32_t, std::uint32_t>> solves() const {
      std::vector<std::tuple<std::uint32_t, std::uint32_t>> all;
      for (const shared::SolveRecord& solve : simulation.solves())
        all.emplace_back(solve.iterations, solve.constraints);
      std::ranges::sort(all);
      return all;
    }

    std::vector<float> normals() {
      const vulkan::Buffer readback(device, vulkan::BufferPurpose::readback, simulation.normals().bytes());
      run([&] {
        simulation.recordNormals(recorder);
        recorder.barrier();
        recorder.copy(simulation.normals(), readback, readback.bytes());
      });
      const std::span<const float> all = readback.mapped<const float>();
      return {all.begin(), all.end()};
    }

    vulkan::Device device;
    vulkan::Recorder recorder;
    simulation::ClothSimulation simulation;
  };

  model::Scene scene_;
  Side cpu_, gpu_;
};

}  // namespace clothstream::kernel_survey
