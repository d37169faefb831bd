// SPDX-License-Identifier: MIT
#include "server/scene/scene_recovery.h"

#include "server/scene/solver_easing.h"

namespace clothstream::scene {
namespace {

SceneRecovery::Parameters parametersOf(const model::Scene& scene) {
  return {.environment = scene.environment, .cloths = SolverEasing::removedFrom(scene.cloths)};
}

}  // namespace

SceneRecovery::SceneRecovery(const model::Scene& start)
    : second_(start.simulationRate), policy_(start.simulationRate), proven_(parametersOf(start)) {}

void SceneRecovery::reset() {
  next_ = Recovery::reset;
  healthyTicks_ = 0;
}

void SceneRecovery::rebuilt() {
  next_ = Recovery::none;
  healthyTicks_ = 0;
}

void SceneRecovery::changed(std::uint64_t tick, const model::Scene& scene) {
  if (!policy_.hasCandidate()) candidate_ = parametersOf(scene);
  policy_.changed(tick);
}

void SceneRecovery::healthy(std::uint64_t tick, const model::Scene& scene) {
  ++healthyTicks_;
  if (!policy_.valid(tick)) return;
  proven_ = std::exchange(candidate_, policy_.hasCandidate() ? parametersOf(scene) : Parameters());
}

SceneRecovery::Cure SceneRecovery::unhealthy(std::uint64_t tick, bool touched) {
  const Cure cure = policy_.invalid(tick, touched);
  healthyTicks_ = 0;
  next_ = cure == Cure::rollback ? Recovery::rollback : Recovery::reset;
  return cure;
}

std::string_view SceneRecovery::describe(Cure cure) {
  switch (cure) {
    case Cure::rollback:
      return ": the scene continues from its newest healthy state, at most a second old";
    case Cure::reset:
      return " twice within a second: its cloths continue from their start";
    case Cure::resetAndLetGo:
      return " twice within a second: its cloths continue from their start, and colliders and grabs of "
             "participants act again after a second";
    case Cure::resetAndUndo:
      return " twice within a second: its cloths continue from their start, without the newest changes of "
             "parameters";
  }
  return {};
}

}  // namespace clothstream::scene
