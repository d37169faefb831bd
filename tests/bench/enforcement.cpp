// SPDX-License-Identifier: MIT
// Suite enforcement: implicit constraint enforcement over all springs, ten substeps of twenty iterations, by
// one workgroup and by several, compared with the time to move an iteration's bytes.
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

constexpr std::uint32_t kSubsteps = 10, kIterations = 20;
// Texels of a node in an iteration: its position, its residual and two of weights are read and a product is
// written; five vectors are read and four written. A copy reads one and writes one.
constexpr double kTexelsMoved = 5 + 9, kTexelsOfACopy = 2;
// Allowed strain while the sheet swings, and mean strain when it hangs; see docs/simulation.md.
constexpr double kMaxStrain = 0.05, kMeanStrain = 0.001;

simulation::SimulationOptions optionsOf(const Settings& settings, bool whole) {
  return {.rowsPerInvocation = settings.rowsPerInvocation,
          .workgroupSize = settings.workgroupSize,
          .solveWholeNodes = whole ? ~0u : 0u};
}

Rows measureSize(vulkan::Device& device, const Settings& settings, std::uint32_t size) {
  const model::Scene scene = hungSheet(size,
                                       {.kind = model::SolverKind::constraint,
                                        .bendConstraints = true,
                                        .compliance = {},
                                        .iterations = kIterations,
                                        .tolerance = 0},
                                       kSubsteps);
  const model::Cloth& cloth = scene.cloths.front();
  const simulation::TickInputs inputs{scene.environment, {}};
  // Both alternate, so that disturbances of the machine affect them alike.
  std::vector<std::unique_ptr<Simulated>> both;
  for (const bool whole : {true, false}) {
    if (size <= 32) checkWithReference(device, scene, optionsOf(settings, whole));
    both.push_back(std::make_unique<Simulated>(device, scene, optionsOf(settings, whole)));
    both.back()->tick(inputs);
    both.back()->forgetTimes();
  }
  double spent = 0;
  while (spent < 2 * settings.seconds || both.front()->wall().count() < 7) {
    for (const std::unique_ptr<Simulated>& one : both) spent += secondsOf([&] { one->tick(inputs); });
    if (both[0]->status().stateHash != both[1]->status().stateHash)
      throw std::runtime_error("one workgroup and several workgroups give different bits");
  }
  const double floor = secondsToCopyTexels(device, cloth.nodeCount()) * kTexelsMoved / kTexelsOfACopy;
  Rows rows;
  for (const std::unique_ptr<Simulated>& one : both) {
    for (const shared::SolveRecord& solve : one->solves())
      if (solve.iterations != kIterations)
        throw std::runtime_error(fmt::format("a solve took {} iterations", solve.iterations));
    const Samples strains = structuralStrains(cloth, one->state());
    if (!(strains.quantile(1) <= kMaxStrain && std::abs(strains.mean()) <= kMeanStrain))
      throw std::runtime_error(
          fmt::format("springs are stretched by {}, by {} in the mean", strains.quantile(1), strains.mean()));
    constexpr double kRounds = kSubsteps * kIterations;
    rows.push_back({{"suite", "enforcement"},
                    {"nodes", cloth.nodeCount()},
                    {"springs", model::springLinks(cloth).size()},
                    {"workgroups", one == both.front() ? "one" : "several"},
                    {"framesPerSecond", 1 / one->wall().median()},
                    {"framesPerSecondBest", 1 / one->wall().min()},
                    {"usPerIteration", one->wall().median() / kRounds * 1e6},
                    {"nsPerNodeIteration", one->wall().median() / kRounds / cloth.nodeCount() * 1e9},
                    {"usToMoveItsBytes", floor * 1e6},
                    {"strainMean", strains.mean()},
                    {"strainMax", strains.quantile(1)},
                    {"ticks", one->wall().count()},
                    {"device", device.info().name}});
  }
  return rows;
}

}  // namespace

void runEnforcement(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  for (const std::uint32_t size :
       settings.size ? std::vector{*settings.size} : std::vector{16u, 32u, 64u, 128u})
    for (const Row& row : measureSize(device, settings, size)) add(row);
}

}  // namespace clothstream::bench
