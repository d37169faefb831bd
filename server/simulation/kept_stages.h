// SPDX-License-Identifier: MIT
// Stages of the solvers that the cloths of a scene had recently.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/bending/bending_stage.h"
#include "server/simulation/solve_stage.h"
#include "server/simulation/solver_stage.h"

namespace clothstream::simulation {

// True if two solvers need the same tables. The way in which systems are solved may differ.
inline bool sameTables(const model::Solver& a, const model::Solver& b) {
  return a.kind == b.kind && a.bendConstraints == b.bendConstraints && a.path == b.path &&
         a.acadMode == b.acadMode &&
         (a.kind == model::SolverKind::massSpring || a.iterations == b.iterations);
}

// Everything on the device that follows from the solvers of the cloths.
struct SolverStages {
  std::vector<model::Solver> solvers;                // of the cloths
  std::shared_ptr<SolveStage::Systems> systems;      // null if there are none
  std::vector<std::unique_ptr<SolverStage>> others;  // that the cloths use, in the order in which they act
  std::uint64_t bytes = 0;                           // of their buffers
};

// Stages that cloths will need (ClothSimulation::makeStages). Each is absent if they need no new one.
struct NewStages {
  std::optional<SolverStages> solvers;
  std::unique_ptr<BendingStage> bending;
};

inline bool haveSameTables(std::span<const model::Solver> a, std::span<const model::Solver> b) {
  return std::ranges::equal(a, b, sameTables);
}

// Keeps stages that are not in use, so that a change to and fro makes nothing. Belongs to the device's
// thread.
class KeptStages {
 public:
  // Limits of what is kept. The oldest go first.
  static constexpr std::size_t kMost = 4;
  static constexpr std::uint64_t kMostBytes = 16'000'000;

  KeptStages() { kept_.reserve(kMost + 1); }  // so that keep() allocates nothing

  bool has(std::span<const model::Solver> solvers) const { return find(solvers) != kept_.end(); }

  // Returns the stages for these solvers, which are not kept any more; nothing if there are none.
  std::optional<SolverStages> take(std::span<const model::Solver> solvers) {
    const auto found = kept_.begin() + (find(solvers) - kept_.cbegin());
    if (found == kept_.end()) return std::nullopt;
    SolverStages stages = std::move(*found);
    kept_.erase(found);
    return stages;
  }

  // No work of the stages, and of those that are kept, may be in flight.
  void keep(SolverStages stages) {
    kept_.push_back(std::move(stages));
    std::uint64_t bytes = 0;
    for (const SolverStages& each : kept_) bytes += each.bytes;
    while (!kept_.empty() && (kept_.size() > kMost || bytes > kMostBytes)) {
      bytes -= kept_.front().bytes;
      kept_.erase(kept_.begin());
    }
  }

 private:
  std::vector<SolverStages>::const_iterator find(std::span<const model::Solver> solvers) const {
    return std::ranges::find_if(
        kept_, [&](const SolverStages& stages) { return haveSameTables(stages.solvers, solvers); });
  }

  std::vector<SolverStages> kept_;
};

}  // namespace clothstream::simulation
