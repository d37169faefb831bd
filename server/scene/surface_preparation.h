// SPDX-License-Identifier: MIT
// Makes the part of a simulation that surfaces of the real room need, before the first one acts.
#pragma once

#include <future>
#include <memory>
#include <string>
#include <utility>

#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"

namespace clothstream::scene {

// Belongs to the device's thread. Without surfaces it costs nothing. With the first one it makes the stage on
// the thread of the loader, since a software device needs tenths of a second to compile the kernel.
class SurfacePreparation {
 public:
  // `loader` must outlive this; null: the stage is made at once.
  explicit SurfacePreparation(SceneLoader* loader) : loader_(loader) {}

  // Returns whether the simulation can run a tick with surfaces, and begins to make the stage if it cannot.
  // Without memory for it, it returns false from then on. Throws vulkan::DeviceLost.
  bool isReady(const std::shared_ptr<SceneOnDevice>& on);
  // Makes the stage on this thread if there is none, which may take tenths of a second.
  static void prepareNow(SceneOnDevice& on);
  // Forgets a stage that is being made.
  void end() { making_ = {}; }
  // Why no stage can be made, once; empty otherwise. isReady() does not try again.
  std::string takeProblem() { return std::exchange(problem_, {}); }

 private:
  SceneLoader* const loader_;
  std::future<std::shared_ptr<simulation::SurfaceStage>> making_;
  bool failed_ = false;
  std::string problem_;
};

}  // namespace clothstream::scene
