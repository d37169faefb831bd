// SPDX-License-Identifier: MIT
// Suite assembled: the constraints' system as in the paper, with sparse matrices that each substep fills and
// multiplies ([Va21] 3.2.2). It alternates with the matrix-free solve of the same scene.
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/model/springs.h"
#include "tests/bench/bytes_moved.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/strain.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

using model::ConstraintPath;

constexpr std::uint32_t kSubsteps = 10, kFew = 20, kMany = 40;
constexpr ConstraintPath kPaths[] = {ConstraintPath::matrixFree, ConstraintPath::assembled};
// Allowed strain while the sheet swings, and mean strain when it hangs; see docs/simulation.md.
constexpr double kMaxStrain = 0.05, kMeanStrain = 0.001;

// Every solve runs all its iterations.
model::Scene sheetOf(std::uint32_t size, bool bend, ConstraintPath path, std::uint32_t iterations) {
  return bench::hungSheet(size,
                          {.kind = model::SolverKind::constraint,
                           .bendConstraints = bend,
                           .compliance = {},
                           .iterations = iterations,
                           .tolerance = 0,
                           .path = path},
                          kSubsteps);
}

// Bytes that an iteration reads and writes, each table and vector once.
double bytesOfIteration(const model::Cloth& cloth) {
  constexpr double kTexel = sizeof(shared::vec4);
  if (!model::isAssembled(cloth.solver)) {
    // For each node: positions, residuals and two texels of weights are read, and a product is written (12 of
    // 16 bytes). Then five vectors are read and four written.
    return cloth.nodeCount() * (4 * kTexel + 12 + 5 * kTexel + 4 * 12);
  }
  // For each entry: column and value, in fours. For each row: its place in the list, its state and its
  // product; then both are read and the state is written.
  const double rows = static_cast<double>(model::systemLinks(cloth).size());
  return static_cast<double>(model::systemEntries(cloth)) * 8 + rows * (2 * kTexel + 4 + 2 * kTexel + kTexel);
}

// Bytes that a substep moves to fill J and to multiply it into the matrix: links, positions and velocities;
// blocks written and read again; columns, sources and values.
double bytesOfAssembly(const model::Cloth& cloth) {
  constexpr double kTexel = sizeof(shared::vec4);
  const double rows = static_cast<double>(model::systemLinks(cloth).size());
  return rows * (kTexel + 2 * kTexel + kTexel) + cloth.nodeCount() * 2 * kTexel + rows * 3 * kTexel +
         static_cast<double>(model::systemEntries(cloth)) * 12;
}

// A path with few and with many iterations; the difference is the cost of iterations. Uses minimum times,
// since a difference of medians would contain disturbances of the machine.
struct Contender {
  std::uint32_t iterationsToConverge;
  std::unique_ptr<Simulated> few, many;

  double secondsOfIteration() const {
    return (many->wall().min() - few->wall().min()) / (kSubsteps * (kMany - kFew));
  }
};

void checkStrain(const model::Cloth& cloth, Simulated& simulated, std::uint32_t iterations) {
  for (const shared::SolveRecord& solve : simulated.solves())
    if (solve.iterations != iterations)
      throw std::runtime_error(fmt::format("a solve took {} iterations", solve.iterations));
  const Samples strains = structuralStrains(cloth, simulated.state());
  if (!(strains.quantile(1) <= kMaxStrain && std::abs(strains.mean()) <= kMeanStrain))
    throw std::runtime_error(
        fmt::format("springs are stretched by {}, by {} in the mean", strains.quantile(1), strains.mean()));
}

Rows measureSize(vulkan::Device& device, const Settings& settings, std::uint32_t size, bool bend) {
  const simulation::TickInputs inputs{model::Scene{}.environment, {}};
  std::array<Contender, 2> contenders;
  std::vector<Simulated*> all;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const std::uint32_t iterations = checkWithReference(
        device, sheetOf(size, bend, kPaths[i], kFew),
        {.workgroupSize = settings.workgroupSize, .solveWholeNodes = settings.solveWholeNodes});
    const auto make = [&](std::uint32_t most) {
      auto made = std::make_unique<Simulated>(
          device, sheetOf(size, bend, kPaths[i], most),
          simulation::SimulationOptions{.workgroupSize = settings.workgroupSize,
                                        .solveWholeNodes = settings.solveWholeNodes});
      made->tick(inputs);
      made->forgetTimes();
      all.push_back(made.get());
      return made;
    };
    contenders[i] = {iterations, make(kFew), make(kMany)};
  }
  // All alternate, so that disturbances of the machine affect them alike.
  double spent = 0;
  while (spent < 4 * settings.seconds || all.front()->wall().count() < 7)
    for (Simulated* one : all) spent += secondsOf([&] { one->tick(inputs); });

  Rows rows;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    const model::Scene scene = sheetOf(size, bend, kPaths[i], kFew);
    const model::Cloth& cloth = scene.cloths.front();
    checkStrain(cloth, *contender.few, kFew);
    checkStrain(cloth, *contender.many, kMany);
    const bool assembled = model::isAssembled(cloth.solver);
    const double bytes = bytesOfIteration(cloth), iteration = contender.secondsOfIteration(),
                 substep = contender.few->wall().min() / kSubsteps;
    const auto texels = static_cast<std::size_t>(bytes / (2 * sizeof(shared::vec4)));
    rows.push_back(
        {{"suite", "assembled"},
         {"path", assembled ? "assembled" : "matrix-free"},
         {"nodes", cloth.nodeCount()},
         {"springs", model::systemLinks(cloth).size()},
         {"bend", bend},
         {"usPerIteration", iteration * 1e6},
         {"usPerIterationWithAll", substep / kFew * 1e6},
         {"usPerIterationWithAllMedian", contender.few->wall().median() / (kSubsteps * kFew) * 1e6},
         {"usBesideIterations", (substep - kFew * iteration) * 1e6},
         {"iterationsToConverge", contender.iterationsToConverge},
         {"kilobytesPerIteration", bytes / 1e3},
         {"kilobytesToAssemble", assembled ? bytesOfAssembly(cloth) / 1e3 : 0},
         {"usToMoveItsBytes", secondsToCopyTexels(device, texels) * 1e6},
         {"strainMean", structuralStrains(cloth, contender.few->state()).mean()},
         {"ticks", contender.few->wall().count()},
         {"device", device.info().name}});
  }
  return rows;
}

}  // namespace

void runAssembled(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  for (const std::uint32_t size : settings.size ? std::vector{*settings.size} : std::vector{32u, 64u})
    for (const bool bend : {false, true})
      for (const Row& row : measureSize(device, settings, size, bend)) add(row);
}

}  // namespace clothstream::bench
