// SPDX-License-Identifier: MIT
// Makes scenes ready for the device while others run on it.
#include "server/stream/scene_preparer.h"

#include <chrono>
#include <stdexcept>
#include <utility>

#include <boost/asio/post.hpp>
#include <spdlog/spdlog.h>

#include "server/stream/clock.h"

namespace clothstream::stream {

ScenePreparer::ScenePreparer(codec::Workers& workers, std::function<void()> done)
    : workers_(workers), done_(std::move(done)) {}

ScenePreparer::~ScenePreparer() {
  abandon();
}

ScenePreparer::Coming ScenePreparer::prepare(vulkan::Device& device, const model::Scene& scene) {
  std::packaged_task<std::unique_ptr<SceneOnDevice>()> task([this, &device, scene, stop = stop_.get_token()] {
    if (stop.stop_requested()) throw std::runtime_error("the scene is not needed any more");
    const Clock::time_point before = Clock::now();
    auto ready = std::make_unique<SceneOnDevice>(device, scene, workers_, stop);
    spdlog::debug("{}: made ready in {:.2f} s", scene.name, seconds(Clock::now() - before));
    return ready;
  });
  Coming coming = task.get_future();
  boost::asio::post(thread_, [this, task = std::move(task)]() mutable {
    task();
    done_();
  });
  return coming;
}

void ScenePreparer::abandon() {
  stop_.request_stop();
  std::packaged_task<void()> last([] {});
  std::future<void> idle = last.get_future();
  boost::asio::post(thread_, std::move(last));
  idle.wait();
  stop_ = {};
}

}  // namespace clothstream::stream
