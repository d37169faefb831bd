// SPDX-License-Identifier: MIT
// A scene on the device that is checked against the reference and then timed tick by tick.
#pragma once

#include <limits>
#include <span>
#include <string>

#include "server/model/scene.h"
#include "server/reference/reference_simulation.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "tests/bench/samples.h"

namespace clothstream::bench {

// Allowed distances from the reference in metres.
struct Tolerance {
  double node = std::numeric_limits<double>::infinity();  // of each node
  double all = std::numeric_limits<double>::infinity();   // root of the sum of the squares of all nodes
};

// A state in which every spring acts: each free node is displaced by up to a fifth of the nodes' distance on
// each axis, and moves.
simulation::NodeState displacedState(const model::Scene& scene);

// Distances that float rounding explains after a tick of explicit springs of a grid.
Tolerance toleranceOfTick(const model::Scene& scene, const simulation::NodeState& start);

class Simulated {
 public:
  Simulated(vulkan::Device& device, const model::Scene& scene, const simulation::SimulationOptions& options);

  // Computes one tick from a displaced state on the device and in the reference. Throws std::runtime_error if
  // they differ by more than float rounding explains. Keeps the resulting state. Returns the reference's
  // seconds.
  double check(const simulation::TickInputs& inputs);
  // The same from a given state and with given tolerances.
  double check(const simulation::NodeState& start, const simulation::TickInputs& inputs, Tolerance tolerance);

  // Records, submits and waits for one tick. Throws std::runtime_error if the state is not healthy.
  void tick(const simulation::TickInputs& inputs);
  // The same with the normals of the new state, which belong to the time of the tick.
  void tickWithNormals(const simulation::TickInputs& inputs);

  // Computes the normals of the present state on the device and in the reference. Throws std::runtime_error
  // if one differs by more than a tenth of a degree. Float rounding explains far less where a sheet is not
  // folded to a point.
  void checkNormals();

  // Returns to the scene's start or to a given state, and discards the times.
  void restart();
  void restart(const simulation::NodeState& start);

  // Status of the last tick.
  simulation::TickStatus status() const { return simulation_.status(); }

  simulation::NodeState state();
  // Contacts of the last tick, if its inputs asked for them.
  std::vector<simulation::ContactStatus> contacts() const {
    std::vector<simulation::ContactStatus> contacts;
    simulation_.readContacts(contacts);
    return contacts;
  }
  std::vector<shared::SolveRecord> solves() const { return simulation_.solves(); }

  // Times of ticks in seconds: wall clock of the whole tick, and the advance stage by the device's clock.
  const Samples& wall() const { return wall_; }
  const Samples& advance() const { return advance_; }
  // Search for near colliders; without colliders there are no samples.
  const Samples& near() const { return near_; }
  void forgetTimes() { wall_ = advance_ = near_ = {}; }

 private:
  template <typename Record>
  void timed(const Record& record);

  vulkan::Device& device_;
  model::Scene scene_;
  vulkan::Recorder recorder_;
  simulation::ClothSimulation simulation_;
  Samples wall_, advance_, near_;
};

// The same inputs for the reference, without attachments and grabs.
reference::TickInputs referenceInputs(const simulation::TickInputs& inputs);

// The scene's only cloth in this state, with its strain and energies.
reference::ReferenceCloth measuredCloth(const model::Cloth& cloth, const simulation::NodeState& state);

// Records with `record`, submits and waits.
void runOn(vulkan::Device& device, vulkan::Recorder& recorder, const auto& record) {
  recorder.begin();
  record();
  device.wait(device.submit(recorder));
}

}  // namespace clothstream::bench
