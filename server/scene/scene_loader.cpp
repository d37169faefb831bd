// SPDX-License-Identifier: MIT
#include "server/scene/scene_loader.h"

#include <chrono>
#include <stdexcept>
#include <utility>

#include <boost/asio/post.hpp>

#include "server/schedule/clock.h"
#include "server/telemetry/log.h"

namespace clothstream::scene {

SceneLoader::SceneLoader(codec::Workers& workers, std::function<void()> done)
    : workers_(workers), done_(std::move(done)) {}

SceneLoader::~SceneLoader() {
  abandon();
}

SceneLoader::Future SceneLoader::load(vulkan::Device& device, const model::Scene& scene) {
  std::packaged_task<std::unique_ptr<SceneOnDevice>()> task([this, &device, scene, stop = stop_.get_token()] {
    if (stop.stop_requested()) throw std::runtime_error("loading was stopped");
    const schedule::Clock::time_point before = schedule::Clock::now();
    auto loaded = std::make_unique<SceneOnDevice>(device, scene, workers_, stop);
    telemetry::log({scene.name}, spdlog::level::debug, "loaded in {:.2f} s",
                   schedule::seconds(schedule::Clock::now() - before));
    return loaded;
  });
  Future loaded = task.get_future();
  boost::asio::post(thread_, [this, task = std::move(task)]() mutable {
    task();
    done_();
  });
  return loaded;
}

void SceneLoader::abandon() {
  stop_.request_stop();
  std::packaged_task<void()> last([] {});
  std::future<void> idle = last.get_future();
  boost::asio::post(thread_, std::move(last));
  idle.wait();
  stop_ = {};
}

}  // namespace clothstream::scene
