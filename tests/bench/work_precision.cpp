// SPDX-License-Identifier: MIT
// Suite work_precision: cost of a simulated second by every solver, against the distance from the true motion
// of the springs.
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/reference/reference_simulation.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kSize = 32, kFramesPerSecond = 60, kFrames = 30;
// Substeps of the double-precision run that the others are compared with, and of the run that estimates its
// error.
constexpr std::uint32_t kReferenceSubsteps = 1024, kCoarserSubsteps = 512;

struct Method {
  const char* name;
  model::SolverKind kind;
  model::Integrator integrator;
  std::uint32_t iterations;
  std::vector<std::uint32_t> substeps;
  bool coarse = false;
};

// Explicit forces start with the fewest substeps that are stable.
std::vector<Method> methods() {
  using enum model::SolverKind;
  using enum model::Integrator;
  return {{"mass_spring", massSpring, semiImplicitEuler, 1, {32, 64, 128, 256}},
          {"Runge-Kutta", massSpring, rungeKutta4, 1, {32, 64}},
          {"acad", acad, semiImplicitEuler, 40, {32, 64}},
          {"xpbd", xpbd, semiImplicitEuler, 1, {4, 8, 16, 32, 64, 128}},
          {"implicit_euler", implicitEuler, semiImplicitEuler, 60, {1, 2, 4, 8, 16}},
          {"constraint", constraint, semiImplicitEuler, 40, {12, 24}},
          {"xpbd_coarse", xpbd, semiImplicitEuler, 1, {2, 4, 8, 32}, true},
          {"implicit_euler_coarse", implicitEuler, semiImplicitEuler, 8, {1, 2, 4}, true}};
}

// A square metre of 0.2 kg whose springs of 200 N/m stretch by a few percent.
model::Cloth sheet() {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = kSize, .columns = kSize, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.2f;
  cloth.structural = {200, 0.01f};
  cloth.shear = {20, 0.005f};
  cloth.bend = {10, 0.005f};
  cloth.damping = 1;
  cloth.friction = 0.5f;
  cloth.thickness = 0.01f;
  return cloth;
}

model::Scene sceneOf(const char* name, model::Cloth cloth) {
  model::Scene scene;
  scene.name = name;
  scene.simulationRate = scene.streamRate = kFramesPerSecond;
  scene.cloths = {std::move(cloth)};
  return scene;
}

// Half a second each of motions that springs determine. Free folding would be random.
std::vector<model::Scene> scenes() {
  const model::GridRange upperEdge{.lastColumn = kSize - 1};
  model::Cloth swinging = sheet();
  swinging.grid.pose.orientation = model::Quaternion(Eigen::AngleAxisf(-1, model::Vec3::UnitX()));
  swinging.pins = {upperEdge};

  model::Cloth pushed = sheet();
  pushed.pins = {upperEdge};
  model::Scene push = sceneOf("push", pushed);
  push.colliders.resize(1);
  push.colliders[0].name = "ball";
  push.colliders[0].shape = model::Sphere{0.2f};
  push.colliders[0].motion.keys = {{0, model::Vec3(0.05f, -0.6f, 0.25f)},
                                   {0.5f, model::Vec3(0.05f, -0.6f, -0.1f)}};

  model::Cloth flying = sheet();
  flying.pins = {{.lastRow = kSize - 1}};
  flying.drag = flying.lift = 0.5f;
  model::Scene flag = sceneOf("flag", flying);
  flag.environment.wind = model::Vec3(4, 0, 1.5f);
  flag.environment.gust = {.strength = 1, .seconds = 1};
  return {sceneOf("swing", swinging), push, flag};
}

// Positions of the nodes after each frame, and the energy at the end in J.
struct Trajectory {
  std::vector<std::vector<reference::Vec3>> frames;
  double energy = 0;
};

double energyOf(const reference::ReferenceCloth& cloth, const model::Scene& scene) {
  return cloth.kineticEnergy() + cloth.elasticEnergy() +
         cloth.gravityEnergy(scene.environment.gravity.cast<double>());
}

Trajectory referenceTrajectory(model::Scene scene, std::uint32_t substeps) {
  scene.substeps = substeps;
  reference::ReferenceSimulation simulation(scene);
  const reference::ReferenceCloth& cloth = simulation.cloths().front();
  Trajectory trajectory;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    simulation.tick();
    trajectory.frames.emplace_back(cloth.positions().begin(), cloth.positions().end());
  }
  trajectory.energy = energyOf(cloth, scene);
  return trajectory;
}

// Root mean square over nodes and frames, in metres.
double distance(const Trajectory& a, const Trajectory& b) {
  double sum = 0;
  for (std::size_t frame = 0; frame < a.frames.size(); ++frame)
    for (std::size_t node = 0; node < a.frames[frame].size(); ++node)
      sum += (a.frames[frame][node] - b.frames[frame][node]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.frames.size() * a.frames[0].size()));
}

struct Measured {
  Trajectory trajectory;
  double seconds;  // of a simulated second
};

Measured measure(vulkan::Device& device, model::Scene scene, const Method& method, std::uint32_t substeps) {
  scene.substeps = substeps;
  scene.integrator = method.integrator;
  scene.cloths.front().solver.kind = method.kind;
  scene.cloths.front().solver.iterations = method.iterations;
  if (method.coarse) scene.cloths.front().coarse = model::CoarseCorrection{4, 4, 2};
  Simulated simulated(device, scene, {});
  Measured measured{};
  simulation::NodeState state;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    simulated.tick(simulation::inputsAt(scene, frame));
    state = simulated.state();
    std::vector<reference::Vec3>& positions = measured.trajectory.frames.emplace_back();
    for (const model::Vec3& position : state.positions) positions.push_back(position.cast<double>());
  }
  measured.trajectory.energy = energyOf(measuredCloth(scene.cloths.front(), state), scene);
  measured.seconds = simulated.wall().median() * kFramesPerSecond;
  return measured;
}

}  // namespace

void runWorkPrecision(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because the sheet has 32x32 nodes");
  for (const model::Scene& scene : scenes()) {
    const Trajectory truth = referenceTrajectory(scene, kReferenceSubsteps);
    const double floor = distance(referenceTrajectory(scene, kCoarserSubsteps), truth);
    std::optional<double> worst;
    for (const Method& method : methods()) {
      for (const std::uint32_t substeps : method.substeps) {
        const Measured measured = measure(device, scene, method, substeps);
        const double error = distance(measured.trajectory, truth);
        if (method.kind == model::SolverKind::massSpring) worst = error;
        add({{"suite", "work_precision"},
             {"scene", scene.name},
             {"method", method.name},
             {"substeps", substeps},
             {"secondsPerSecond", measured.seconds},
             {"error", error},
             {"referenceError", floor},
             {"energyLost", truth.energy - measured.trajectory.energy},
             {"device", device.info().name}});
      }
    }
    // Explicit forces converge to the truth with smaller steps. If they do not, something is wrong.
    if (!(*worst < 0.005))
      throw std::runtime_error(fmt::format("{}: the finest forces are {} m off", scene.name, *worst));
  }
}

}  // namespace clothstream::bench
