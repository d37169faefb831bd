// SPDX-License-Identifier: MIT
#include "server/scene/scene_loader.h"

#include <chrono>
#include <stdexcept>
#include <utility>

#include <boost/asio/post.hpp>
#include <malloc.h>

#include "server/schedule/clock.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::scene {
namespace {

// A driver needs tens of megabytes to compile kernels. The C library keeps such memory for the threads that
// have used it, and so the server would grow with each loss of the device.
void giveMemoryBack() {
  ::malloc_trim(0);
}

}  // namespace

SceneLoader::SceneLoader(codec::Workers& workers, std::function<void()> done)
    : workers_(workers), done_(std::move(done)) {
  boost::asio::post(thread_, [] { telemetry::nameThread("scene loader"); });
}

SceneLoader::Future SceneLoader::load(vulkan::Device& device, const model::Scene& scene,
                                      std::stop_token stop) {
  return run([this, &device, scene, stop = std::move(stop)] { return loadNow(device, scene, stop); });
}

std::unique_ptr<SceneOnDevice> SceneLoader::loadNow(vulkan::Device& device, const model::Scene& scene,
                                                    const std::stop_token& stop) {
  if (stop.stop_requested()) throw std::runtime_error("loading was stopped");
  const schedule::Clock::time_point before = schedule::Clock::now();
  auto loaded = std::make_unique<SceneOnDevice>(device, scene, workers_, stop);
  telemetry::log({scene.name}, spdlog::level::debug, "loaded in {:.2f} s",
                 schedule::seconds(schedule::Clock::now() - before));
  return loaded;
}

void SceneLoader::post(std::function<void()> task) {
  boost::asio::post(thread_, [this, task = std::move(task)] {
    task();
    done_();
    giveMemoryBack();
  });
}

void SceneLoader::wait() {
  std::packaged_task<void()> last([] {});
  std::future<void> idle = last.get_future();
  boost::asio::post(thread_, std::move(last));
  idle.wait();
}

}  // namespace clothstream::scene
