// SPDX-License-Identifier: MIT
// Parameters of a running scene, and the changes that act on them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/model/scene.h"
#include "server/scene/inbox.h"
#include "server/scene/rehearsal.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"
#include "server/scene/solver_easing.h"
#include "server/schedule/making_limit.h"

namespace clothstream::scene {

// Holds the scene with its present parameters, and gives those of cloths to the device when they change.
// Changes of solvers are eased (SolverEasing). Changes that need new stages wait until earlier ones are paid
// for (schedule::MakingLimit) and until their kernels are compiled (Rehearsal). Belongs to the device's
// thread.
class SceneParameters {
 public:
  // The scene begins with the parameters of `start`. `loader` as for Rehearsal.
  SceneParameters(const model::Scene& start, SceneLoader* loader);
  // Continues from a checkpoint with this scene and this easing. The caller gives the device its cloths.
  void restore(const model::Scene& scene, std::vector<std::uint64_t> easeUntil);

  const model::Scene& scene() const { return scene_; }
  const std::vector<std::uint64_t>& easeUntil() const { return easing_.until(); }

  // A tick begins.
  void beginTick();
  // Ends the easing of solvers that lasts until `tick`. Throws the exceptions of
  // ClothSimulation::setCloths().
  void endEasing(SceneOnDevice& on, std::uint64_t tick);

  struct Applied {
    std::size_t count = 0;  // changes that act, from the first on
    // Why the next one can never act, because the device has no room for it. Empty: it waits, if there is
    // one.
    std::string problem = {};
  };
  // Applies these changes together after `tick`. Those that would make stages may have to wait for a later
  // tick, and so do all after them. Throws vulkan::DeviceLost; the parameters are then as before, but not on
  // the device.
  Applied apply(const std::shared_ptr<SceneOnDevice>& on, std::span<const AcceptedChange> changes,
                std::uint64_t tick, Clock::time_point now);
  // Replaces all parameters by those of `scene` after `tick`. Throws the exceptions of setCloths().
  void replace(SceneOnDevice& on, model::Scene scene, std::uint64_t tick);
  // Replaces all parameters by these. upload() gives them to the device.
  void undo(const model::Environment& environment, const std::vector<model::Cloth>& cloths);
  // Throws the exceptions of setCloths().
  void upload(SceneOnDevice& on) { setCloths(on, scene_.cloths); }

  // The next tick is recorded: kernels of its stages need not be kept any longer.
  void tickRecorded() { rehearsal_.release(); }
  // The tick that began at `start` took this much longer on the device than the one before. If changes made
  // something, they pay for it: a device may compile new kernels when they first run.
  void payFirstRun(Clock::time_point start, double seconds);

  // Return whether parameters, or those of cloths on the device, have changed since the last call.
  bool takeChanged() { return std::exchange(changed_, false); }
  bool takeClothsChanged() { return std::exchange(clothsChanged_, false); }

  // Time of this thread that changes of cloths have taken since beginTick().
  Clock::duration makingTime() const { return makingTime_; }
  // Returns whether changes wait for their kernels.
  bool isRehearsing() const { return rehearsal_.isUnderWay(); }
  // Stops the rehearsal of such changes. They go on waiting.
  void endRehearsal() { rehearsal_.end(); }

 private:
  bool makesStages(const simulation::ClothSimulation& simulation,
                   std::span<const AcceptedChange> changes) const;
  // Applies all of these changes, or changes nothing and says why.
  Applied applyAll(SceneOnDevice& on, std::span<const AcceptedChange> changes, std::uint64_t tick,
                   Clock::time_point now);
  void setCloths(SceneOnDevice& on, const std::vector<model::Cloth>& cloths);

  model::Scene scene_;
  SolverEasing easing_;
  schedule::MakingLimit making_;
  Clock::duration makingTime_{};
  bool changed_ = false, clothsChanged_ = false;
  Rehearsal rehearsal_;
};

}  // namespace clothstream::scene
