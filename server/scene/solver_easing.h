// SPDX-License-Identifier: MIT
// Eases changes of solvers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::scene {

// A new solver may correct at once the stretch that the former one allowed, and the cloth would jump. For
// kSeconds after a change of solver, the excess length of springs therefore shrinks as exp(-t / kTime): the
// correction fraction of the cloth is limited. Ticks are numbers that only grow. Not thread-safe.
class SolverEasing {
 public:
  static constexpr double kSeconds = 0.5, kTime = 0.1;

  // Eases no change yet.
  explicit SolverEasing(std::size_t cloths) : until_(cloths, 0) {}
  // Continues from until().
  explicit SolverEasing(std::vector<std::uint64_t> until) : until_(std::move(until)) {}

  // A change after `tick` makes `changed` of `before`: limits the corrections of `changed`.
  void change(const model::Scene& before, model::Scene& changed, std::uint64_t tick);
  // Removes the limits that last until `tick`. Returns whether `scene` has changed.
  bool end(model::Scene& scene, std::uint64_t tick) const;

  // Tick at which the easing of each cloth ends.
  const std::vector<std::uint64_t>& until() const { return until_; }

  // Returns the cloths without limits.
  static std::vector<model::Cloth> removedFrom(std::vector<model::Cloth> cloths);

 private:
  std::vector<std::uint64_t> until_;
};

}  // namespace clothstream::scene
