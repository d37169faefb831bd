// SPDX-License-Identifier: MIT
// Scenes and states that the tests of the simulation share, and a way to run them.
#include "tests/simulation/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

namespace clothstream::tests {

model::Cloth calmCloth(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth;
  cloth.name = "cloth";
  cloth.grid = {.rows = rows,
                .columns = columns,
                .width = 0.02f * static_cast<float>(columns - 1),
                .height = 0.02f * static_cast<float>(rows - 1),
                .pose = {}};
  cloth.mass = 0.01f * static_cast<float>(rows * columns);
  cloth.structural = {200, 0.2f};
  cloth.shear = {100, 0.1f};
  cloth.bend = {20, 0.05f};
  cloth.damping = 0.5f;
  return cloth;
}

model::Cloth looseCloth(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth = calmCloth(rows, columns);
  cloth.structural = cloth.shear = cloth.bend = {};
  cloth.damping = 0;
  cloth.thickness = 0.004f;
  return cloth;
}

model::Cloth assembled(model::Cloth cloth, bool bendConstraints) {
  cloth.solver.kind = model::SolverKind::constraint;
  cloth.solver.path = model::ConstraintPath::assembled;
  cloth.solver.bendConstraints = bendConstraints;
  return cloth;
}

model::Cloth discCloth(std::uint32_t rings) {
  model::Cloth cloth = calmCloth(2, 2);
  cloth.mesh = std::make_shared<const model::Mesh>(
      model::makeMesh(model::disc(rings, 0.02f * static_cast<float>(rings))));
  cloth.mass = 0.02f * static_cast<float>(cloth.nodeCount());
  return cloth;
}

model::GridRange topRow(const model::Cloth& cloth) {
  return {.firstRow = 0,
          .lastRow = 0,
          .rowStep = 1,
          .firstColumn = 0,
          .lastColumn = cloth.grid.columns - 1,
          .columnStep = 1};
}

model::Scene sceneOf(std::vector<model::Cloth> cloths) {
  model::Scene scene;
  scene.cloths = std::move(cloths);
  return scene;
}

simulation::NodeState randomState(const model::Scene& scene, std::mt19937& random, float displacement,
                                  float speed) {
  simulation::NodeState state = simulation::restState(scene.cloths);
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return model::Vec3(unit(random), unit(random), unit(random)); };
  for (std::size_t i = 0; i < masses.size(); ++i) {
    if (masses[i] == 0) continue;
    state.positions[i] += displacement * vector();
    state.velocities[i] = speed * vector();
  }
  return state;
}

simulation::TickInputs inputsOf(const model::Scene& scene,
                                std::vector<simulation::MovingCollider> colliders) {
  simulation::TickInputs inputs{scene.environment, std::move(colliders)};
  inputs.winds.assign(scene.winds.begin(), scene.winds.end());
  return inputs;
}

reference::TickInputs referenceInputs(const simulation::TickInputs& inputs) {
  reference::TickInputs result{inputs.environment, {}};
  result.winds = inputs.winds;
  for (const simulation::MovingCollider& collider : inputs.colliders)
    result.colliders.push_back({collider.shape, reference::toPose(collider.start),
                                reference::toPose(collider.end), double{collider.friction},
                                collider.jointsStart, collider.jointsEnd, collider.jumped,
                                reference::toPose(collider.before), collider.jointsBefore});
  for (const simulation::PlacedSurface& placed : inputs.surfaces)
    result.surfaces.push_back({std::shared_ptr<const model::Surface>(placed.table, &placed.table->surface),
                               reference::toPose(placed.pose), placed.twoSided, double{placed.friction}});
  for (const model::Pose& pose : inputs.attachments) result.attachments.push_back(reference::toPose(pose));
  for (const model::Carry& carry : inputs.carries)
    result.carries.push_back({carry.cloth, reference::toPose(carry.from), reference::toPose(carry.to)});
  for (const simulation::Grab& grab : inputs.grabs) {
    result.grabs.push_back({.state = static_cast<reference::Grab::State>(grab.state),
                            .start = reference::toPose(grab.start),
                            .end = reference::toPose(grab.end),
                            .radius = double{grab.radius},
                            .reach = double{grab.reach},
                            .maxForce = double{grab.maxForce},
                            .slipDistance = double{grab.slipDistance},
                            .leftAtStart = double{grab.leftAtStart},
                            .leftAtEnd = double{grab.leftAtEnd}});
    if (!grab.place) continue;
    reference::Grab::Place& place = result.grabs.back().place.emplace();
    for (std::size_t i = 0; i < 3; ++i) {
      place.nodes[i] = grab.place->nodes[i];
      place.weights[i] = double{grab.place->weights[i]};
    }
  }
  return result;
}

model::Hull octahedron() {
  std::vector<model::Vec3> corners;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {0.1f, -0.1f}) corners.push_back(side * model::Vec3::Unit(axis));
  auto made = model::makeConvexHull(
      corners, {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
  return std::make_shared<const model::ConvexHull>(std::get<model::ConvexHull>(std::move(made)));
}

model::Quaternion turned(float degrees, const model::Vec3& axis) {
  return model::Quaternion(Eigen::AngleAxisf(degrees * std::acos(-1.0f) / 180, axis.normalized()));
}

void setState(reference::ReferenceSimulation& reference, const simulation::NodeState& state) {
  std::size_t node = 0;
  for (reference::ReferenceCloth& cloth : reference.cloths())
    for (std::uint32_t i = 0; i < cloth.nodeCount(); ++i, ++node) {
      cloth.positions()[i] = state.positions[node].cast<double>();
      cloth.velocities()[i] = state.velocities[node].cast<double>();
    }
}

double largestDistance(const simulation::NodeState& state, const reference::ReferenceSimulation& reference) {
  double largest = 0;
  std::size_t node = 0;
  for (const reference::ReferenceCloth& cloth : reference.cloths())
    for (const reference::Vec3& position : cloth.positions())
      largest = std::max(largest, (state.positions[node++].cast<double>() - position).norm());
  return largest;
}

double largestSpeedDifference(const simulation::NodeState& state,
                              const reference::ReferenceSimulation& reference) {
  double largest = 0;
  std::size_t node = 0;
  for (const reference::ReferenceCloth& cloth : reference.cloths())
    for (const reference::Vec3& velocity : cloth.velocities())
      largest = std::max(largest, (state.velocities[node++].cast<double>() - velocity).norm());
  return largest;
}

reference::Strain strainOf(const model::Scene& scene, const simulation::NodeState& state) {
  reference::ReferenceSimulation reference(scene);
  setState(reference, state);
  return reference.cloths().front().strain();
}

Running::Running(const model::Scene& scene, simulation::SimulationOptions options, vulkan::Device& device)
    : device_(device), recorder_(device), simulation_(device, scene, options) {}

template <typename Record>
void Running::run(const Record& record) {
  recorder_.begin();
  record();
  submitAndWait(device_, recorder_);
}

simulation::TickStatus Running::tick(const simulation::TickInputs& inputs) {
  run([&] { simulation_.recordTick(recorder_, inputs); });
  return simulation_.status();
}

std::uint64_t Running::dispatches(const simulation::TickInputs& inputs) {
  recorder_.beginRehearsal();
  simulation_.recordTick(recorder_, inputs);
  std::uint64_t sum = 0;
  for (const vulkan::RehearsedKernel& kernel : recorder_.rehearsed()) sum += kernel.dispatches;
  return sum;
}

std::vector<simulation::ClothReport> Running::tickAndReport(const simulation::TickInputs& inputs) {
  run([&] {
    simulation_.recordTick(recorder_, inputs);
    simulation_.recordReport(recorder_, inputs);
  });
  return simulation_.report();
}

std::vector<std::vector<std::uint32_t>> Running::tickAndName(simulation::TickInputs inputs) {
  inputs.namesConstraints = true;
  tickAndReport(inputs);
  return simulation_.constraintEnds();
}

void Running::restore(const simulation::NodeState& state) {
  restore(simulation::pack(state, 0));
}

void Running::restore(const simulation::StateSnapshot& snapshot) {
  run([&] { simulation_.recordRestoreState(recorder_, snapshot); });
}

simulation::StateSnapshot Running::save() {
  run([&] { simulation_.recordSaveState(recorder_); });
  return simulation_.collectState(0);
}

std::vector<model::Vec3> Running::normals() {
  const std::size_t bytes = simulation_.normals().bytes();
  const vulkan::Buffer readback(device_, vulkan::BufferPurpose::readback, bytes);
  run([&] {
    simulation_.recordNormals(recorder_);
    recorder_.barrier();
    recorder_.copy(simulation_.normals(), readback, bytes);
  });
  std::vector<model::Vec3> normals;
  for (const shared::vec4& n : readback.mapped<const shared::vec4>()) normals.emplace_back(n.x, n.y, n.z);
  return normals;
}

void Running::checkpoint() {
  run([&] { simulation_.recordCheckpoint(recorder_); });
}

void Running::rollback() {
  run([&] { simulation_.recordRollback(recorder_); });
}

simulation::TickInputs passingBall(const model::Scene& scene, int tick) {
  const auto place = [](int t) {
    return model::Pose{model::Vec3(0.02f, -0.15f, 0.2f - 0.005f * static_cast<float>(t % 80))};
  };
  return inputsOf(scene, {{model::Sphere{0.08f}, place(tick), place(tick + 1), 1}});
}

std::uint64_t hashAfter(const model::Scene& scene, InputsAt inputs, int ticks,
                        const simulation::SimulationOptions& options, vulkan::Device& device) {
  Running running(scene, options, device);
  simulation::TickStatus status;
  for (int tick = 0; tick < ticks; ++tick) status = running.tick(inputs(scene, tick));
  EXPECT_TRUE(status.healthy);
  return status.stateHash;
}

void expectSameBits(const model::Scene& scene, InputsAt inputs, int ticks,
                    std::span<const simulation::SimulationOptions> ways) {
  const std::uint64_t first = hashAfter(scene, inputs, ticks, ways.front());
  for (std::size_t i = 1; i < ways.size(); ++i)
    EXPECT_EQ(hashAfter(scene, inputs, ticks, ways[i]), first) << "way " << i;
}

int longRunTicks() {
  return std::getenv("CLOTHSTREAM_THOUSAND_TICKS") != nullptr ? 1000 : 250;
}

void expectSameLongRuns(const model::Scene& scene, InputsAt inputs,
                        const simulation::SimulationOptions& other) {
  Running one(scene), again(scene), differently(scene, other);
  for (int tick = 0; tick < longRunTicks(); ++tick) {
    const simulation::TickInputs now = inputs(scene, tick);
    const simulation::TickStatus status = one.tick(now);
    ASSERT_TRUE(status.healthy) << tick;
    ASSERT_EQ(again.tick(now).stateHash, status.stateHash) << tick;
    if (tick < 100) {
      ASSERT_EQ(differently.tick(now).stateHash, status.stateHash) << tick;
    }
  }
}

Reports expectSameReports(const model::Scene& scene, InputsAt inputs,
                          const simulation::SimulationOptions& one,
                          const simulation::SimulationOptions& other) {
  Running first(scene, one), second(scene, other);
  Reports reports;
  for (int tick = 0; tick < 10; ++tick) {
    reports.push_back(first.tickAndReport(inputs(scene, tick)));
    const auto theirs = second.tickAndReport(inputs(scene, tick));
    for (std::size_t i = 0; i < theirs.size(); ++i) {
      SCOPED_TRACE(::testing::Message() << scene.cloths[i].name << ", tick " << tick);
      const simulation::ClothReport& mine = reports.back()[i];
      EXPECT_EQ(mine.iterations, theirs[i].iterations);
      EXPECT_EQ(mine.residual, theirs[i].residual);
      EXPECT_EQ(mine.activeConstraints, theirs[i].activeConstraints);
      const model::Solver& solver = scene.cloths[i].solver;
      EXPECT_LE(mine.iterations, model::iterationsOf(solver));
      if (mine.iterations < model::iterationsOf(solver)) {
        EXPECT_LE(mine.residual, solver.tolerance);
      }
    }
  }
  return reports;
}

void expectGoesOnAsAlways(Running& changing, const model::Scene& changed,
                          const simulation::TickInputs& inputs, int ticks) {
  const simulation::StateSnapshot kept = changing.save();
  changing.setCloths(changed.cloths);
  EXPECT_EQ(changing.save().bytes, kept.bytes);
  Running always(changed);
  always.restore(kept);
  for (int tick = 0; tick < ticks; ++tick) {
    const simulation::TickStatus status = changing.tick(inputs);
    ASSERT_TRUE(status.healthy);
    ASSERT_EQ(status.stateHash, always.tick(inputs).stateHash) << "tick " << tick;
  }
  EXPECT_EQ(changing.solves().size(), always.solves().size());
}

}  // namespace clothstream::tests
