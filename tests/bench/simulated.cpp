// SPDX-License-Identifier: MIT
// A scene on the device that is checked against the reference and then timed tick by tick.
#include "tests/bench/simulated.h"

#include <algorithm>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "server/model/wind.h"
#include "server/reference/reference_simulation.h"

namespace clothstream::bench {
namespace {

// Every free node is displaced by up to a fifth of the nodes' distance and moves, so that every spring acts.
simulation::NodeState displacedState(const model::Scene& scene) {
  simulation::NodeState state = simulation::restState(scene.cloths);
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  const float reach = 0.2f * model::spacing(scene.cloths.front().grid).column;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    if (masses[i] == 0) continue;
    state.positions[i] += reach * model::Vec3(unit(random), unit(random), unit(random));
    state.velocities[i] = 0.1f * model::Vec3(unit(random), unit(random), unit(random));
  }
  return state;
}

}  // namespace

reference::ReferenceCloth measuredCloth(const model::Cloth& cloth, const simulation::NodeState& state) {
  reference::ReferenceCloth measured(cloth);
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node) {
    measured.positions()[node] = state.positions[node].cast<double>();
    measured.velocities()[node] = state.velocities[node].cast<double>();
  }
  return measured;
}

Simulated::Simulated(vulkan::Device& device, const model::Scene& scene,
                     const simulation::SimulationOptions& options)
    : device_(device), scene_(scene), recorder_(device), simulation_(device, scene, options) {}

double Simulated::check(const simulation::TickInputs& inputs) {
  // A tick moves a position by sums of rounded terms. Each substep rounds it once, to 2^-24 of the cloth's
  // extent, and twelve spring forces pass on the rounding of their ends. An eighth of a thousandth of the
  // nodes' distance is far above that and far below the effect of any missing term.
  const model::Grid& grid = scene_.cloths.front().grid;
  const double extent = std::max(double{grid.width}, double{grid.height});
  const double tolerance = scene_.substeps * 20 * extent / (1 << 24) + model::spacing(grid).column / 8000.0;
  return check(inputs, tolerance);
}

double Simulated::check(const simulation::TickInputs& inputs, double tolerance) {
  return check(displacedState(scene_), inputs, tolerance);
}

double Simulated::check(const simulation::NodeState& start, const simulation::TickInputs& inputs,
                        double tolerance) {
  runOn(device_, recorder_, [&] { simulation_.recordRestoreState(recorder_, simulation::pack(start, 0)); });
  tick(inputs);
  const simulation::NodeState state = this->state();

  reference::ReferenceSimulation reference(scene_);
  reference::TickInputs referenceInputs{inputs.environment, {}};
  for (const simulation::MovingCollider& collider : inputs.colliders)
    referenceInputs.colliders.push_back({collider.shape, reference::toPose(collider.start),
                                         reference::toPose(collider.end), double{collider.friction}});
  std::size_t node = 0;
  for (reference::ReferenceCloth& cloth : reference.cloths())
    for (std::uint32_t i = 0; i < cloth.nodeCount(); ++i, ++node) {
      cloth.positions()[i] = start.positions[node].cast<double>();
      cloth.velocities()[i] = start.velocities[node].cast<double>();
    }
  const double seconds = secondsOf([&] { reference.tick(referenceInputs); });

  node = 0;
  for (const reference::ReferenceCloth& cloth : reference.cloths())
    for (const reference::Vec3& expected : cloth.positions()) {
      const double distance = (state.positions[node].cast<double>() - expected).norm();
      if (!(distance <= tolerance))
        throw std::runtime_error(
            fmt::format("node {} is {} m from its place in the reference; at most {} m are allowed", node,
                        distance, tolerance));
      ++node;
    }
  return seconds;
}

void Simulated::restart() {
  restart(simulation::restState(scene_.cloths));
}

void Simulated::restart(const simulation::NodeState& start) {
  runOn(device_, recorder_, [&] { simulation_.recordRestoreState(recorder_, simulation::pack(start, 0)); });
  forgetTimes();
}

simulation::NodeState Simulated::state() {
  runOn(device_, recorder_, [&] { simulation_.recordSaveState(recorder_); });
  return simulation::unpack(simulation_.collectState(0));
}

void Simulated::tick(const simulation::TickInputs& inputs) {
  wall_.add(
      secondsOf([&] { runOn(device_, recorder_, [&] { simulation_.recordTick(recorder_, inputs); }); }));
  for (const vulkan::StageTime& time : recorder_.stageTimes())
    if (time.stage == "advance")
      advance_.add(time.seconds);
    else if (time.stage == "near")
      near_.add(time.seconds);
  if (!simulation_.status().healthy) throw std::runtime_error("the state is no longer finite");
}

}  // namespace clothstream::bench
