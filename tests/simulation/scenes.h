// SPDX-License-Identifier: MIT
// Scenes and states that the tests of the simulation share, and a way to run them.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/reference_simulation.h"
#include "server/simulation/cloth_simulation.h"
#include "tests/model/meshes.h"
#include "tests/model/solids.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {

// Half a unit in the last place, relative.
inline constexpr double kRounding = 1.0 / (1 << 24);
// m; all nodes of these tests are nearer to the origin.
inline constexpr double kExtent = 4;

// Settings of solvers whose results are compared.
inline constexpr float kSolveTolerance = 1e-6f;
inline constexpr std::uint32_t kSolveIterations = 2000;

// rows x columns nodes with 2 cm between them, 10 g a node, springs and damping far inside the stability
// bound.
model::Cloth calmCloth(std::uint32_t rows, std::uint32_t columns);
// The same nodes without springs and damping, 4 mm thick: only contacts and gravity move them.
model::Cloth looseCloth(std::uint32_t rows, std::uint32_t columns);
// Enforced by constraints, with the matrices assembled.
model::Cloth assembled(model::Cloth cloth, bool bendConstraints = false);
// A disc of rings 2 cm apart with the springs of a calm cloth; its lightest node has more than 10 g.
model::Cloth discCloth(std::uint32_t rings);
model::GridRange topRow(const model::Cloth& cloth);
// 72 ticks a second of ten substeps.
model::Scene sceneOf(std::vector<model::Cloth> cloths);

// Each component off its place at rest, and each velocity off zero, by up to these; pinned nodes as they are.
simulation::NodeState randomState(const model::Scene& scene, std::mt19937& random, float displacement,
                                  float speed);

simulation::TickInputs inputsOf(const model::Scene& scene,
                                std::vector<simulation::MovingCollider> colliders = {});
reference::TickInputs referenceInputs(const simulation::TickInputs& inputs);

// An octahedron of 20 cm, its corners on the axes.
model::Hull octahedron();
model::Quaternion turned(float degrees, const model::Vec3& axis);

void setState(reference::ReferenceSimulation& reference, const simulation::NodeState& state);
// Largest distance between corresponding nodes.
double largestDistance(const simulation::NodeState& state, const reference::ReferenceSimulation& reference);
double largestSpeedDifference(const simulation::NodeState& state,
                              const reference::ReferenceSimulation& reference);

// Strain of the first cloth.
reference::Strain strainOf(const model::Scene& scene, const simulation::NodeState& state);

// A simulation with the objects that it needs to run.
class Running {
 public:
  explicit Running(const model::Scene& scene, simulation::SimulationOptions options = {},
                   vulkan::Device& device = tests::device());

  simulation::TickStatus tick(const simulation::TickInputs& inputs);
  void restore(const simulation::NodeState& state);
  void restore(const simulation::StateSnapshot& snapshot);
  simulation::StateSnapshot save();
  simulation::NodeState state() { return simulation::unpack(save()); }
  std::vector<model::Vec3> normals();
  std::vector<shared::SolveRecord> solves() const { return simulation_.solves(); }
  std::vector<simulation::ContactStatus> contacts() const {
    std::vector<simulation::ContactStatus> contacts;
    simulation_.readContacts(contacts);
    return contacts;
  }
  std::vector<simulation::GrabStatus> grabs() const {
    std::vector<simulation::GrabStatus> grabs;
    simulation_.readGrabs(grabs);
    return grabs;
  }
  std::vector<float> depths() const {
    std::vector<float> depths;
    simulation_.readDepths(depths);
    return depths;
  }
  // Dispatches of a tick, also those that the device makes empty. The tick does not run.
  std::uint64_t dispatches(const simulation::TickInputs& inputs);
  // Runs one tick with a report. Returns the reports of all cloths.
  std::vector<simulation::ClothReport> tickAndReport(const simulation::TickInputs& inputs);
  // The same with the names of the active constraints: their ends, by cloth.
  std::vector<std::vector<std::uint32_t>> tickAndName(simulation::TickInputs inputs);
  void setCloths(std::span<const model::Cloth> cloths) { simulation_.setCloths(cloths); }
  std::uint64_t stagesMade() const { return simulation_.stagesMade(); }
  void setSubsteps(std::uint32_t substeps, std::span<const model::Cloth> cloths) {
    simulation_.setSubsteps(substeps, cloths);
  }
  void checkpoint();
  void rollback();

 private:
  template <typename Record>
  void run(const Record& record);

  vulkan::Device& device_;
  vulkan::Recorder recorder_;
  simulation::ClothSimulation simulation_;
};

// Checks of determinism. `InputsAt` gives the inputs of a tick.
using InputsAt = simulation::TickInputs (*)(const model::Scene& scene, int tick);
// A ball of 8 cm passes repeatedly through the place where small cloths hang.
simulation::TickInputs passingBall(const model::Scene& scene, int tick);

// Expects the same bits after `ticks` ticks with each of these partitions of the work.
void expectSameBits(const model::Scene& scene, InputsAt inputs, int ticks,
                    std::span<const simulation::SimulationOptions> ways);
// Ticks of a long run: 250, or 1,000 in the test `thousand_ticks`, which is labelled `long`.
int longRunTicks();
// Expects the same hashes in two long runs, and in a hundred ticks with the options `other`.
void expectSameLongRuns(const model::Scene& scene, InputsAt inputs,
                        const simulation::SimulationOptions& other);
// Expects the same reports of ten ticks with both options, and returns them for further checks.
using Reports = std::vector<std::vector<simulation::ClothReport>>;
Reports expectSameReports(const model::Scene& scene, InputsAt inputs,
                          const simulation::SimulationOptions& one,
                          const simulation::SimulationOptions& other);
std::uint64_t hashAfter(const model::Scene& scene, InputsAt inputs, int ticks,
                        const simulation::SimulationOptions& options = {},
                        vulkan::Device& device = tests::device());

// Gives a running scene the cloths of `changed`. Expects that the state keeps every bit, and that the motion
// then has the same bits as that of a simulation that always had these cloths and continues from that state.
void expectGoesOnAsAlways(Running& changing, const model::Scene& changed,
                          const simulation::TickInputs& inputs, int ticks);

}  // namespace clothstream::tests
