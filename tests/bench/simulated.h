// SPDX-License-Identifier: MIT
// A scene on the device that is timed tick by tick, and checked against the reference first.
#pragma once

#include <span>
#include <string>

#include "server/model/scene.h"
#include "server/reference/reference_cloth.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "tests/bench/samples.h"

namespace clothstream::bench {

class Simulated {
 public:
  Simulated(vulkan::Device& device, const model::Scene& scene, const simulation::SimulationOptions& options);

  // One tick from a displaced state on the device and in the reference; throws std::runtime_error where
  // they differ by more than float rounding explains. Leaves the state it reached. Returns the reference's
  // seconds.
  double check(const simulation::TickInputs& inputs);
  // The same with this distance allowed, m.
  double check(const simulation::TickInputs& inputs, double tolerance);
  // From this state.
  double check(const simulation::NodeState& start, const simulation::TickInputs& inputs, double tolerance);

  // Records, submits and waits for one tick; throws std::runtime_error if its state is not healthy.
  void tick(const simulation::TickInputs& inputs);

  // Back to the scene's start, or to this state, and the times forgotten.
  void restart();
  void restart(const simulation::NodeState& start);

  // Of the last tick.
  simulation::TickStatus status() const { return simulation_.status(); }

  simulation::NodeState state();
  std::vector<shared::SolveRecord> solves() const { return simulation_.solves(); }

  // Of a tick: all of it on the wall clock, and its advance stage by the device's clock. s.
  const Samples& wall() const { return wall_; }
  const Samples& advance() const { return advance_; }
  // Its search for what is near; where there are colliders.
  const Samples& near() const { return near_; }
  void forgetTimes() { wall_ = advance_ = near_ = {}; }

 private:
  vulkan::Device& device_;
  model::Scene scene_;
  vulkan::Recorder recorder_;
  simulation::ClothSimulation simulation_;
  Samples wall_, advance_, near_;
};

// A scene's only cloth in this state, with its strain and energies.
reference::ReferenceCloth measuredCloth(const model::Cloth& cloth, const simulation::NodeState& state);

// Records with `record`, submits, waits.
void runOn(vulkan::Device& device, vulkan::Recorder& recorder, const auto& record) {
  recorder.begin();
  record();
  device.wait(device.submit(recorder));
}

}  // namespace clothstream::bench
