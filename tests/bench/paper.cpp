// SPDX-License-Identifier: MIT
// Suite paper: Figures 7 to 10 of [Va21] at the paper's sizes. Our frame is one step of its time step, alone
// and with a falling ball and normals, without rendering. The paper's frame is a rendered frame of a Unity
// scene (docs/benchmarks.md).
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/model/springs.h"
#include "server/reference/reference_simulation.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/strain.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// The paper's step is 0.005 s. It gives neither masses nor lengths; these are stable with its largest
// stiffness.
constexpr std::uint32_t kStepsPerSecond = 200;
constexpr float kSpacing = 0.1f, kNodeMass = 0.1f, kStiffness = 200, kDamping = 0.1f;
// The paper averages over 500 frames.
constexpr std::size_t kFrames = 500;
// Largest relative residual of a row that counts as converged.
constexpr float kConverged = 0.01f;

struct Case {
  int figure;
  const char* method;
  std::uint32_t rows, columns;
  nlohmann::ordered_json paper;  // frames/s, or words where the paper gives no number
  model::Solver solver = {};
  bool onCpu = false;  // the serial reference in double precision, without the device
};

model::Solver constraints(bool bend, std::optional<float> compliance) {
  return {.kind = model::SolverKind::constraint,
          .bendConstraints = bend,
          .compliance = compliance,
          .iterations = 1000,
          .tolerance = kConverged};
}

std::vector<Case> cases() {
  model::Solver acad = constraints(true, {});
  acad.kind = model::SolverKind::acad;
  acad.iterations = 100;
  model::Solver paperAcad = acad;
  paperAcad.acadMode = model::AcadMode::paper;
  return {{7, "mass_spring", 96, 96, "above 200"},
          {7, "mass_spring", 256, 256, "above 200"},
          {7, "mass_spring on the CPU", 96, 96, 44.83, {}, true},
          {7, "mass_spring on the CPU", 256, 256, "44.08 (Unity's cloth)", {}, true},
          {8, "mass_spring", 5717, 1368, 34.81},
          {9, "constraint", 32, 32, 66.06, constraints(false, 0.0f)},
          {9, "constraint", 38, 38, 44.25, constraints(false, 0.0f)},
          {9, "constraint", 34, 34, 31.95, constraints(true, 0.0f)},
          {9, "constraint", 32, 32, 66.06, constraints(false, {})},
          {9, "constraint", 38, 38, 44.25, constraints(false, {})},
          {9, "constraint", 34, 34, 31.95, constraints(true, {})},
          {10, "mass_spring", 32, 32, 222.46},
          {10, "constraint", 32, 32, "barely 30", constraints(true, 0.0f)},
          {10, "constraint", 32, 32, "barely 30", constraints(true, {})},
          {10, "acad", 32, 32, 206.44, acad},
          {10, "acad_paper", 32, 32, 206.44, paperAcad}};
}

model::Scene sceneOf(const Case& experiment) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = experiment.rows,
                .columns = experiment.columns,
                .width = kSpacing * static_cast<float>(experiment.columns - 1),
                .height = kSpacing * static_cast<float>(experiment.rows - 1),
                .pose = {}};
  cloth.mass = kNodeMass * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = cloth.shear = cloth.bend = {kStiffness, kDamping};
  cloth.damping = 0.5f;
  cloth.pins = {{.firstRow = 0,
                 .lastRow = 0,
                 .firstColumn = 0,
                 .lastColumn = experiment.columns - 1,
                 .columnStep = experiment.columns - 1}};
  cloth.solver = experiment.solver;
  model::Scene scene;
  scene.name = "paper";
  scene.simulationRate = scene.streamRate = kStepsPerSecond;
  scene.substeps = 1;
  scene.cloths = {cloth};
  return scene;
}

// A ball of a quarter of the sheet's height falls along the sheet, from above its upper edge to below its
// lower edge, again and again. It reaches half of its radius through the sheet's plane and pushes it aside.
struct FallingBall {
  float radius, top;    // m; height of the centre at the start of a fall
  std::uint32_t steps;  // of a fall

  explicit FallingBall(const model::Grid& grid) : radius(grid.height / 8), top(radius) {
    const double way = double{grid.height} + 2 * double{radius};
    steps = static_cast<std::uint32_t>(std::sqrt(2 * way / 9.81) * kStepsPerSecond);
  }
  simulation::MovingCollider at(std::uint32_t step) const {
    const auto centre = [&](std::uint32_t of) {
      const double seconds = static_cast<double>(of) / kStepsPerSecond;
      return model::Vec3(0, top - static_cast<float>(0.5 * 9.81 * seconds * seconds), radius / 2);
    };
    step %= steps;
    return {model::Sphere{radius}, {centre(step)}, {centre(step + 1)}, 1};
  }
};

// Contents of a frame: the simulation alone, or also the falling ball and the normals.
struct Frame {
  model::Environment environment;
  std::optional<FallingBall> ball;

  simulation::TickInputs inputs(std::uint32_t step) const {
    simulation::TickInputs inputs{environment, {}};
    if (ball) inputs.colliders = {ball->at(step)};
    return inputs;
  }
};

// Compares with the reference; with the ball in the middle of the sheet, and the normals.
void check(vulkan::Device& device, const model::Scene& scene, const Frame& frame) {
  if (!frame.ball) {
    checkWithReference(device, scene, {});
    return;
  }
  // The ball has fallen through half of the way after 0.7 of the time.
  const simulation::TickInputs inputs = frame.inputs(frame.ball->steps * 7 / 10);
  const simulation::NodeState start = displacedState(scene);
  checkWithReference(device, scene, {}, start, inputs);
  Simulated simulated(device, scene, {});
  simulated.restart(start);
  simulated.checkNormals();
}

// A frame that is repeated and timed, on the device or on the CPU.
struct Contender {
  Frame frame;
  std::unique_ptr<Simulated> device;
  std::unique_ptr<reference::ReferenceSimulation> cpu;  // rows of the device are compared with it
  Samples secondsOnCpu = {}, iterations = {}, residuals = {};
  bool finite = true;

  const Samples& seconds() const { return device ? device->wall() : secondsOnCpu; }

  void step() {
    const simulation::TickInputs inputs = frame.inputs(static_cast<std::uint32_t>(seconds().count()));
    if (cpu) {
      stepOnCpu(referenceInputs(inputs));
      return;
    }
    try {
      frame.ball ? device->tickWithNormals(inputs) : device->tick(inputs);
    } catch (const std::runtime_error&) {
      finite = false;  // the system can be singular with compliance 0
    }
    for (const shared::SolveRecord& solve : device->solves()) {
      iterations.add(solve.iterations);
      residuals.add(double{solve.residual});
    }
  }

  void stepOnCpu(const reference::TickInputs& inputs) {
    const reference::ReferenceCloth& cloth = cpu->cloths().front();
    std::size_t normals = 0;
    secondsOnCpu.add(secondsOf([&] {
      cpu->tick(inputs);
      if (frame.ball) normals = cloth.normals().size();
    }));
    if (frame.ball && normals != cloth.nodeCount())
      throw std::runtime_error("the reference has no normal for each node");
  }

  simulation::NodeState state() const {
    if (device) return device->state();
    simulation::NodeState state;
    for (const reference::Vec3& position : cpu->cloths().front().positions())
      state.positions.push_back(position.cast<float>());
    return state;
  }
};

Row rowOf(const vulkan::Device& device, const Case& experiment, const model::Cloth& cloth,
          const Contender& contender) {
  const std::vector<model::SpringLink> links = model::springLinks(cloth);
  nlohmann::ordered_json row{
      {"suite", "paper"},
      {"figure", experiment.figure},
      {"method", experiment.method},
      {"nodes", cloth.grid.nodeCount()},
      {"springs", std::ranges::count_if(links,
                                        [&](const model::SpringLink& link) {
                                          return cloth.solver.kind != model::SolverKind::constraint ||
                                                 model::isConstraint(cloth.solver, link.kind);
                                        })},
      {"ballAndNormals", contender.frame.ball.has_value()},
      {"framesPerSecond", 1 / contender.seconds().median()},
      {"paperFramesPerSecond", experiment.paper}};
  if (contender.iterations.count() > 0) {
    row["compliance"] = cloth.solver.compliance ? nlohmann::ordered_json(*cloth.solver.compliance)
                                                : nlohmann::ordered_json("default");
    row["iterations"] = contender.iterations.median();
    row["residual"] = contender.residuals.median();
    row["converged"] = contender.finite && contender.residuals.p99() <= double{kConverged};
  }
  row["finite"] = contender.finite;
  if (contender.finite) row["strainP99"] = structuralStrains(cloth, contender.state()).p99();
  row["frames"] = contender.seconds().count();
  row["device"] = experiment.onCpu ? "the CPU, one thread" : device.info().name;
  return row;
}

// Measures a case without and with the ball and the normals. Both alternate, so that disturbances of the
// machine affect them alike.
Rows measure(vulkan::Device& device, const Settings& settings, const Case& experiment) {
  const model::Scene scene = sceneOf(experiment);
  std::vector<Contender> both;
  for (const bool withBallAndNormals : {false, true}) {
    Contender contender{{scene.environment, {}}, nullptr, nullptr};
    if (withBallAndNormals) contender.frame.ball = FallingBall(scene.cloths.front().grid);
    if (experiment.onCpu) {
      contender.cpu = std::make_unique<reference::ReferenceSimulation>(scene);
    } else {
      check(device, scene, contender.frame);
      contender.device = std::make_unique<Simulated>(
          device, scene,
          simulation::SimulationOptions{.rowsPerInvocation = settings.rowsPerInvocation,
                                        .workgroupSize = settings.workgroupSize});
    }
    both.push_back(std::move(contender));
  }
  double spent = 0;
  for (std::size_t frame = 0; frame < kFrames && (frame < 5 || spent < 20 * settings.seconds); ++frame)
    for (Contender& contender : both)
      if (contender.finite) spent += secondsOf([&] { contender.step(); });
  Rows rows;
  for (const Contender& contender : both)
    rows.push_back(rowOf(device, experiment, scene.cloths.front(), contender));
  return rows;
}

}  // namespace

void runPaper(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because the sizes are the paper's");
  for (const Case& experiment : cases()) {
    try {
      for (const Row& row : measure(device, settings, experiment)) add(row);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("Figure {}: {}", experiment.figure, error.what()));
    }
  }
}

}  // namespace clothstream::bench
