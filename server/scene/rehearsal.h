// SPDX-License-Identifier: MIT
// Makes what changes of a scene need, before they act.
#pragma once

#include <cstddef>
#include <future>
#include <memory>
#include <span>
#include <stop_token>
#include <utility>

#include "server/model/scene.h"
#include "server/scene/inbox.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"

namespace clothstream::scene {

// A change of a solver may need kernels that no scene uses yet, and tables. They take up to seconds, which no
// other scene may wait for. So the changed scene is loaded a second time meanwhile, on the loader's thread,
// which compiles all kernels: those of one device share what is compiled. Then the loader's thread makes the
// stages. Belongs to the device's thread.
class Rehearsal {
 public:
  // `loader` is null if changes make what they need themselves. It must outlive this object.
  explicit Rehearsal(SceneLoader* loader) : loader_(loader) {}
  ~Rehearsal() { end(); }
  Rehearsal(const Rehearsal&) = delete;
  Rehearsal& operator=(const Rehearsal&) = delete;

  // `changes` wait to be applied to `scene`, which runs as `on`. Returns how many of them, from the first on,
  // may act now: `on` has their stages. If there are none, begins to rehearse all of them unless a rehearsal
  // is under way. Throws vulkan::DeviceLost.
  std::size_t rehearsed(const std::shared_ptr<SceneOnDevice>& on, const model::Scene& scene,
                        std::span<const AcceptedChange> changes);
  // No change waits for a rehearsal any more: drops what a finished one has made.
  void dropFinished();
  bool isUnderWay() const;
  // Seconds of the loader's thread that rehearsals took since the last call.
  double takeSeconds() { return std::exchange(seconds_, 0); }
  // A tick that needs the kernels of the changes is recorded.
  void release() { loaded_.reset(); }
  // Stops what is under way. The loader's thread may use the device until SceneLoader::wait() has returned.
  void end();

 private:
  struct Made {
    std::shared_ptr<SceneOnDevice> on;  // outlives its stages
    std::unique_ptr<SceneOnDevice> loaded;
    std::shared_ptr<simulation::NewStages> stages;
  };

  void begin(const std::shared_ptr<SceneOnDevice>& on, model::Scene changed);

  SceneLoader* const loader_;
  std::future<Made> making_;
  std::stop_source stop_;
  std::shared_ptr<double> took_;           // seconds of the loader's thread, once making_ is ready
  std::size_t count_ = 0;                  // of changes that it rehearses
  std::unique_ptr<SceneOnDevice> loaded_;  // keeps the kernels
  double seconds_ = 0;
};

}  // namespace clothstream::scene
