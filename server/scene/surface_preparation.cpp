// SPDX-License-Identifier: MIT
#include "server/scene/surface_preparation.h"

#include <chrono>
#include <exception>
#include <utility>

#include "server/simulation/collision/surface_stage.h"
#include "server/vulkan/recorder.h"

namespace clothstream::scene {
namespace {

std::shared_ptr<simulation::SurfaceStage> makeStage(SceneOnDevice& on) {
  std::shared_ptr<simulation::SurfaceStage> stage = on.simulation.makeSurfaces();
  if (const vulkan::Kernel& kernel = stage->kernel().kernel(); !kernel.isReady()) {
    vulkan::Recorder recorder(on.device);
    recorder.begin();
    recorder.touch(stage->kernel());
    on.device.wait(on.device.submit(recorder));
    kernel.setReady();
  }
  return stage;
}

}  // namespace

bool SurfacePreparation::isReady(const std::shared_ptr<SceneOnDevice>& on) {
  if (on->simulation.hasSurfaces()) return true;
  if (failed_) return false;
  try {
    if (loader_ == nullptr) {
      prepareNow(*on);
      return true;
    }
    if (!making_.valid()) making_ = loader_->run([on] { return makeStage(*on); });
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    on->simulation.takeSurfaces(making_.get());
    return true;
  } catch (const vulkan::DeviceLost&) {
    throw;
  } catch (const std::exception& failure) {
    failed_ = true;
    problem_ = failure.what();
    return false;
  }
}

void SurfacePreparation::prepareNow(SceneOnDevice& on) {
  if (!on.simulation.hasSurfaces()) on.simulation.takeSurfaces(makeStage(on));
}

}  // namespace clothstream::scene
