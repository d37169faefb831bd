// SPDX-License-Identifier: MIT
// Makes scenes ready for the device while others run on it.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <stop_token>

#include <boost/asio/thread_pool.hpp>

#include "server/model/scene.h"
#include "server/stream/scene_on_device.h"
#include "server/vulkan/device.h"

namespace clothstream::stream {

// One after the other, on a thread of its own. Belongs to the device's thread.
class ScenePreparer {
 public:
  using Coming = std::future<std::unique_ptr<SceneOnDevice>>;

  // `done` is called on its thread whenever one is ready or has failed. `workers` outlive it.
  ScenePreparer(codec::Workers& workers, std::function<void()> done);
  ~ScenePreparer();
  ScenePreparer(const ScenePreparer&) = delete;
  ScenePreparer& operator=(const ScenePreparer&) = delete;

  // The device must live until that is ready, or abandon() returns. The future throws what SceneOnDevice
  // throws.
  Coming prepare(vulkan::Device& device, const model::Scene& scene);

  // Whatever is not ready yet never will be. Returns when nothing is at work any more.
  void abandon();

 private:
  codec::Workers& workers_;
  const std::function<void()> done_;
  std::stop_source stop_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace clothstream::stream
