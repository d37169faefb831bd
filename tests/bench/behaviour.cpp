// SPDX-License-Identifier: MIT
// Suite behaviour: Figures 11 to 15 of [Va21] as pictures, each with a check of what it shows.
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/picture/picture.h"
#include "tests/bench/picture/render.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/strain.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// The paper gives neither masses nor lengths. Its springs of 200 N/m are stable at 0.005 s and blow up at
// 0.016 s. Nodes of 0.03 to 0.3 kg with twelve springs behave so. Its sheets are as wide as Unity's plane.
constexpr std::uint32_t kNodes = 32;  // nodes a side: the 1,024 nodes and 5,826 springs of Figure 10
constexpr float kNodeMass = 0.13f, kWidth = 10, kSpringDamping = 0.1f;
// Ticks of one step. 0.016 s is no whole number of steps a second; this is 0.0161 s.
constexpr std::uint32_t kShortSteps = 200, kLongSteps = 62;
constexpr std::uint32_t kSeconds = 6;
// Seconds after which a step is compared with the reference: in free fall, at the first contact, and draped.
constexpr double kCompared[] = {0.25, 0.5, 1, 2, 4};
// Time after which a sheet with the one-sided limit must be at rest in Figure 15, and its kinetic energy
// then, J. At 4 mm/s the whole sheet of 133 kg has as much. It stays at rest for ten seconds more; then it
// begins to slide off the ball, as sheets of every solver do (docs/behaviour.md).
constexpr std::uint32_t kRestSeconds = 30;
constexpr double kRestEnergy = 1e-3;

// Strain of a spring at which the sheet counts as torn.
constexpr double kTorn = 6;

constexpr float kBallRadius = 2.5f;
const model::Vec3 kBall(0, 3.3f, 0);

struct Panel {
  const char* method;
  float stiffness;  // N/m
  model::Solver solver = {};
};

struct Outcome {
  Panel panel;
  bool healthy = true;
  int compared = 0;  // steps that agree with the reference
  Samples strains = {};
  double lowest = 1000;      // m, lowest node
  double depth = 0;          // m, depth of the deepest node in the ball
  double kineticEnergy = 0;  // J
  double largestStrain = 0;  // of any tick; only of Figure 13
  double largestAt = 0;      // s, end of that tick
  double restEnergy = 0;     // J, kinetic, after kRestSeconds; only of the limit in Figure 15
  Picture picture = {};
};

struct Figure {
  int number;
  std::uint32_t stepsASecond;
  std::vector<Panel> panels;
  // Throws std::runtime_error if the outcomes differ from what the paper's figure shows.
  void (*check)(std::span<const Outcome> outcomes);
};

void expect(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

void expectHealthy(std::span<const Outcome> outcomes) {
  for (const Outcome& outcome : outcomes)
    expect(outcome.healthy, fmt::format("{}, ks {}: left the range of numbers", outcome.panel.method,
                                        outcome.panel.stiffness));
}

// "Large ks presents as hard cloth, small ks as soft cloth."
void expectHarderFromLeftToRight(std::span<const Outcome> outcomes) {
  expectHealthy(outcomes);
  for (std::size_t i = 1; i < outcomes.size(); ++i)
    expect(outcomes[i].strains.mean() < outcomes[i - 1].strains.mean(),
           fmt::format("ks {} stretches by {} in the mean, ks {} by {}", outcomes[i].panel.stiffness,
                       outcomes[i].strains.mean(), outcomes[i - 1].panel.stiffness,
                       outcomes[i - 1].strains.mean()));
  for (const Outcome& outcome : outcomes)
    expect(outcome.depth == 0,
           fmt::format("ks {}: {} m inside the ball", outcome.panel.stiffness, outcome.depth));
}

void checkAcad(std::span<const Outcome> outcomes) {
  expectHarderFromLeftToRight(outcomes);
  for (const Outcome& outcome : outcomes)
    expect(
        outcome.strains.quantile(1) < 0.15,
        fmt::format("ks {}: a spring stretched by {}", outcome.panel.stiffness, outcome.strains.quantile(1)));
}

// Constraints hold. With bend springs among them the sheet is a plate, which does not hang down as far.
void checkBend(std::span<const Outcome> outcomes) {
  expectHealthy(outcomes);
  for (const Outcome& outcome : outcomes)
    expect(outcome.strains.quantile(1) < 0.1,
           fmt::format("{}: a spring stretched by {}", outcome.panel.method, outcome.strains.quantile(1)));
  expect(outcomes[0].lowest < outcomes[1].lowest,
         fmt::format("without bend springs it reaches down to {} m, with them to {}", outcomes[0].lowest,
                     outcomes[1].lowest));
}

// "The cloth is stretched more" without bend springs.
void checkBendAndStretch(std::span<const Outcome> outcomes) {
  checkBend(outcomes);
  expect(outcomes[0].strains.p99() > outcomes[1].strains.p99(),
         fmt::format("without bend springs it stretches by {} at p99, with them by {}",
                     outcomes[0].strains.p99(), outcomes[1].strains.p99()));
}

// Springs of the paper's mode jump whenever they become constraints, so that the sheet never rests.
void expectJumping(const Outcome& paper, const Outcome& other) {
  expect(paper.kineticEnergy > 2 * other.kineticEnergy,
         fmt::format("ks {}: {} J with {}, {} J with {}", paper.panel.stiffness, paper.kineticEnergy,
                     paper.panel.method, other.kineticEnergy, other.panel.method));
}

// The same sheets with the one-sided limit, then as in the paper.
void checkAcadModes(std::span<const Outcome> outcomes) {
  const std::size_t count = outcomes.size() / 2;
  checkAcad(outcomes.first(count));
  expectHealthy(outcomes);
  for (std::size_t i = 0; i < count; ++i) expectJumping(outcomes[count + i], outcomes[i]);
  for (const Outcome& outcome : outcomes.first(count))
    expect(outcome.largestStrain < 0.14,
           fmt::format("ks {}: a spring stretched by {} after {} s, and by {} after {:.3f} s",
                       outcome.panel.stiffness, outcome.strains.quantile(1), kSeconds, outcome.largestStrain,
                       outcome.largestAt));
}

void checkBlowUp(std::span<const Outcome> outcomes) {
  expect(!outcomes[0].healthy, "the mass-spring sheet did not blow up");
  expectHealthy(outcomes.subspan(1));
  expectJumping(outcomes[2], outcomes[1]);
  expect(outcomes[1].restEnergy < kRestEnergy,
         fmt::format("ACAD: {} J after {} s", outcomes[1].restEnergy, kRestSeconds));
  expect(outcomes[1].depth == 0 && outcomes[1].strains.p99() < 0.5,
         fmt::format("ACAD: {} m inside the ball, stretched by {} at p99", outcomes[1].depth,
                     outcomes[1].strains.p99()));
}

model::Solver solverOf(model::SolverKind kind, bool bend) {
  model::Solver solver;
  solver.kind = kind;
  solver.bendConstraints = bend;
  solver.iterations = 60;
  return solver;
}

std::vector<Figure> figures() {
  const model::Solver acad = solverOf(model::SolverKind::acad, true);
  model::Solver paper = acad;
  paper.acadMode = model::AcadMode::paper;
  const std::vector<Panel> bend{
      {"constraint, without bend", 200, solverOf(model::SolverKind::constraint, false)},
      {"constraint, with bend", 200, solverOf(model::SolverKind::constraint, true)}};
  return {{11,
           kShortSteps,
           {{"mass_spring", 100}, {"mass_spring", 200}, {"mass_spring", 600}},
           &expectHarderFromLeftToRight},
          {12, kShortSteps, bend, &checkBendAndStretch},
          {13,
           kShortSteps,
           {{"acad", 100, acad},
            {"acad", 200, acad},
            {"acad", 600, acad},
            {"acad_paper", 100, paper},
            {"acad_paper", 200, paper},
            {"acad_paper", 600, paper}},
           &checkAcadModes},
          {14, kLongSteps, bend, &checkBend},
          {15,
           kLongSteps,
           {{"mass_spring", 200}, {"acad", 200, acad}, {"acad_paper", 200, paper}},
           &checkBlowUp}};
}

model::Scene sceneOf(const Figure& figure, const Panel& panel) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = kNodes, .columns = kNodes, .width = kWidth, .height = kWidth, .pose = {}};
  cloth.grid.pose.position = {0, kBall.y() + kBallRadius + 0.5f, -kWidth / 2};
  cloth.grid.pose.orientation = model::Quaternion(std::sqrt(0.5f), -std::sqrt(0.5f), 0, 0);
  cloth.mass = kNodeMass * static_cast<float>(kNodes * kNodes);
  cloth.structural = cloth.shear = cloth.bend = {panel.stiffness, kSpringDamping};
  if (panel.solver.kind == model::SolverKind::constraint && !panel.solver.bendConstraints) cloth.bend = {};
  cloth.damping = 0.5f;
  cloth.friction = 0.8f;
  cloth.thickness = 0.1f;
  cloth.solver = panel.solver;
  model::Scene scene;
  scene.name = "behaviour";
  scene.simulationRate = scene.streamRate = figure.stepsASecond;
  scene.substeps = 1;
  scene.cloths = {cloth};
  scene.colliders.resize(2);
  scene.colliders[0].name = "ball";
  scene.colliders[0].shape = model::Sphere{kBallRadius};
  scene.colliders[0].pose.position = kBall;
  scene.colliders[1].name = "floor";
  scene.colliders[1].shape = model::Plane{};
  return scene;
}

Picture pictureOf(const model::Scene& scene, const simulation::NodeState& state) {
  const model::Grid& grid = scene.cloths.front().grid;
  Surface cloth{state.positions,
                model::clothTriangles(scene.cloths.front()),
                {0.72f, 0.12f, 0.13f},
                {0.85f, 0.55f, 0.20f},
                {}};
  for (std::uint32_t row = 0; row < grid.rows; ++row)
    for (std::uint32_t column = 0; column < grid.columns; ++column)
      cloth.lines.emplace_back(static_cast<float>(column) / 4 + 0.125f, static_cast<float>(row) / 4 + 0.125f);
  constexpr float kMiddle = 2.8f;
  const Surface surfaces[] = {std::move(cloth), sphereSurface(kBall, kBallRadius, {0.25f, 0.45f, 0.75f})};
  return render(
      {.eye = {7, kMiddle + 7, 17}, .target = {0, kMiddle, 0}, .height = 10.5f, .width = 320, .rows = 300},
      surfaces);
}

// Runs for all seconds, or until the state is not finite. Then the outcome is the state in which a spring
// first tore. Compares steps with the reference until then.
Outcome run(vulkan::Device& device, const Figure& figure, const Panel& panel) {
  const model::Scene scene = sceneOf(figure, panel);
  const model::Cloth& cloth = scene.cloths.front();
  simulation::TickInputs inputs{scene.environment, {}};
  for (const model::Collider& collider : scene.colliders)
    inputs.colliders.push_back({collider.shape, collider.pose, collider.pose, collider.friction});
  Simulated simulated(device, scene, {});
  Outcome outcome{panel};
  std::optional<simulation::NodeState> torn;
  for (std::uint32_t tick = 0; tick < kSeconds * figure.stepsASecond && outcome.healthy; ++tick) {
    const bool isCompared = std::ranges::any_of(kCompared, [&](double seconds) {
      return tick == static_cast<std::uint32_t>(seconds * figure.stepsASecond);
    });
    if (isCompared && !torn) {
      checkWithReference(device, scene, {}, simulated.state(), inputs);
      ++outcome.compared;
    }
    try {
      simulated.tick(inputs);
    } catch (const std::runtime_error&) {
      outcome.healthy = false;
      break;
    }
    if (figure.number == 13)
      if (const double strain = largestStrain(cloth, simulated.state()); strain > outcome.largestStrain) {
        outcome.largestStrain = strain;
        outcome.largestAt = static_cast<double>(tick + 1) * scene.tickSeconds();
      }
    if (figure.number != 15 || torn) continue;
    simulation::NodeState state = simulated.state();
    if (structuralStrains(cloth, state).quantile(1) > kTorn) torn = std::move(state);
  }
  const simulation::NodeState state = outcome.healthy || !torn ? simulated.state() : *torn;
  outcome.strains = structuralStrains(cloth, state);
  outcome.kineticEnergy = measuredCloth(cloth, state).kineticEnergy();
  for (const model::Vec3& position : state.positions) {
    outcome.lowest = std::min(outcome.lowest, double{position.y()});
    outcome.depth = std::max(outcome.depth, double{kBallRadius - (position - kBall).norm()});
  }
  outcome.picture = pictureOf(scene, state);
  if (figure.number == 15 && model::isAcad(panel.solver, model::AcadMode::limit)) {
    for (std::uint32_t tick = kSeconds * figure.stepsASecond; tick < kRestSeconds * figure.stepsASecond;
         ++tick)
      simulated.tick(inputs);
    outcome.restEnergy = measuredCloth(cloth, simulated.state()).kineticEnergy();
  }
  return outcome;
}

}  // namespace

void runBehaviour(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because the sizes are the paper's");
  for (const Figure& figure : figures()) {
    std::vector<Outcome> outcomes;
    std::vector<Picture> pictures;
    for (const Panel& panel : figure.panels) {
      try {
        outcomes.push_back(run(device, figure, panel));
      } catch (const std::runtime_error& error) {
        throw std::runtime_error(
            fmt::format("Figure {}, ks {}: {}", figure.number, panel.stiffness, error.what()));
      }
      pictures.push_back(outcomes.back().picture);
    }
    const auto file = settings.pictures / fmt::format("figure_{}.png", figure.number);
    writePng(sideBySide(pictures), file);
    for (const Outcome& outcome : outcomes)
      add({{"suite", "behaviour"},
           {"figure", figure.number},
           {"method", outcome.panel.method},
           {"stepSeconds", 1.0 / figure.stepsASecond},
           {"stiffness", outcome.panel.stiffness},
           {"healthy", outcome.healthy},
           {"comparedSteps", outcome.compared},
           {"strainMean", outcome.strains.mean()},
           {"strainP99", outcome.strains.p99()},
           {"strainMax", outcome.strains.quantile(1)},
           {"kineticEnergy", outcome.kineticEnergy},
           {"largestStrain", outcome.largestStrain},
           {"restEnergy", outcome.restEnergy},
           {"lowest", outcome.lowest},
           {"picture", file.string()},
           {"device", device.info().name}});
    try {
      figure.check(outcomes);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("Figure {}: {}", figure.number, error.what()));
    }
  }
}

}  // namespace clothstream::bench
