// SPDX-License-Identifier: MIT
// A scene on the device that is checked against the reference and then timed tick by tick.
#include "tests/bench/simulated.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "server/model/wind.h"

namespace clothstream::bench {

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

// A tick moves a position by sums of rounded terms. Each substep rounds it once, to 2^-24 of the cloth's
// extent, and twelve spring forces pass on the rounding of their ends: 20 roundings. A coarse correction sums
// along the rows and columns of two cells, and a sweep corrects eight links of a coarse node.
Tolerance toleranceOfTick(const model::Scene& scene, const simulation::NodeState& start) {
  const model::Cloth& cloth = scene.cloths.front();
  const model::Grid& grid = cloth.grid;
  float extent = std::max(grid.width, grid.height);
  for (const model::Vec3& position : start.positions)
    extent = std::max(extent, position.cwiseAbs().maxCoeff());
  double roundings = 20;
  if (const auto& coarse = cloth.coarse)
    roundings +=
        coarse->levels * (4.0 * std::max(grid.rows, grid.columns) / coarse->cells + 8 * coarse->sweeps);
  return {.node = scene.substeps * roundings * double{extent} / (1 << 24)};
}

reference::TickInputs referenceInputs(const simulation::TickInputs& inputs) {
  reference::TickInputs result{inputs.environment, {}};
  result.winds = inputs.winds;
  for (const simulation::MovingCollider& collider : inputs.colliders)
    result.colliders.push_back({collider.shape, reference::toPose(collider.start),
                                reference::toPose(collider.end), double{collider.friction}});
  return result;
}

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
  const simulation::NodeState start = displacedState(scene_);
  return check(start, inputs, toleranceOfTick(scene_, start));
}

double Simulated::check(const simulation::NodeState& start, const simulation::TickInputs& inputs,
                        Tolerance tolerance) {
  runOn(device_, recorder_, [&] { simulation_.recordRestoreState(recorder_, simulation::pack(start, 0)); });
  tick(inputs);
  const simulation::NodeState state = this->state();

  reference::ReferenceSimulation reference(scene_);
  std::size_t node = 0;
  for (reference::ReferenceCloth& cloth : reference.cloths())
    for (std::uint32_t i = 0; i < cloth.nodeCount(); ++i, ++node) {
      cloth.positions()[i] = start.positions[node].cast<double>();
      cloth.velocities()[i] = start.velocities[node].cast<double>();
    }
  const double seconds = secondsOf([&] { reference.tick(referenceInputs(inputs)); });

  node = 0;
  double squares = 0;
  for (const reference::ReferenceCloth& cloth : reference.cloths())
    for (const reference::Vec3& expected : cloth.positions()) {
      const double distance = (state.positions[node].cast<double>() - expected).norm();
      if (!(distance <= tolerance.node))
        throw std::runtime_error(
            fmt::format("node {} is {} m from its place in the reference; at most {} m are allowed", node,
                        distance, tolerance.node));
      squares += distance * distance;
      ++node;
    }
  if (!(std::sqrt(squares) <= tolerance.all))
    throw std::runtime_error(fmt::format(
        "all nodes together (root of the sum of squares) are {} m from their places in the reference; "
        "at most {} m are allowed",
        std::sqrt(squares), tolerance.all));
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

template <typename Record>
void Simulated::timed(const Record& record) {
  wall_.add(secondsOf([&] { runOn(device_, recorder_, record); }));
  for (const vulkan::StageTime& time : recorder_.stageTimes())
    if (time.stage == "advance")
      advance_.add(time.seconds);
    else if (time.stage == "near")
      near_.add(time.seconds);
  if (!simulation_.status().healthy) throw std::runtime_error("the state is no longer finite");
}

void Simulated::tick(const simulation::TickInputs& inputs) {
  timed([&] { simulation_.recordTick(recorder_, inputs); });
}

void Simulated::tickWithNormals(const simulation::TickInputs& inputs) {
  timed([&] {
    simulation_.recordTick(recorder_, inputs);
    simulation_.recordNormals(recorder_);
  });
}

void Simulated::checkNormals() {
  constexpr double kAllowed = 0.1 * std::numbers::pi / 180;
  const std::size_t bytes = simulation_.normals().bytes();
  const vulkan::Buffer readback(device_, vulkan::BufferPurpose::readback, bytes);
  runOn(device_, recorder_, [&] {
    simulation_.recordNormals(recorder_);
    recorder_.barrier();
    recorder_.copy(simulation_.normals(), readback, bytes);
  });
  const std::span<const shared::vec4> found = readback.mapped<const shared::vec4>();
  const std::vector<reference::Vec3> expected = measuredCloth(scene_.cloths.front(), state()).normals();
  for (std::size_t node = 0; node < expected.size(); ++node) {
    const reference::Vec3 normal(found[node].x, found[node].y, found[node].z);
    if (!((normal - expected[node]).norm() <= kAllowed))
      throw std::runtime_error(
          fmt::format("the normal of node {} differs by {} from that of the reference; at most {} is allowed",
                      node, (normal - expected[node]).norm(), kAllowed));
  }
}

}  // namespace clothstream::bench
