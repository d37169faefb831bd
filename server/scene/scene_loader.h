// SPDX-License-Identifier: MIT
// Loads scenes onto the device while other scenes run on it.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <stop_token>

#include <boost/asio/thread_pool.hpp>

#include "server/model/scene.h"
#include "server/scene/scene_on_device.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {

// Loads one scene at a time, on a worker thread. Belongs to the device's thread.
class SceneLoader {
 public:
  using Future = std::future<std::unique_ptr<SceneOnDevice>>;

  // `done` is called on the worker thread when a scene is loaded or has failed. `workers` must outlive the
  // loader.
  SceneLoader(codec::Workers& workers, std::function<void()> done);
  ~SceneLoader();
  SceneLoader(const SceneLoader&) = delete;
  SceneLoader& operator=(const SceneLoader&) = delete;

  // The device must live until the future is ready or abandon() has returned. The future throws what the
  // constructor of SceneOnDevice throws.
  Future load(vulkan::Device& device, const model::Scene& scene);

  // Stops loading; unfinished futures throw. Returns when the worker thread is idle.
  void abandon();

 private:
  codec::Workers& workers_;
  const std::function<void()> done_;
  std::stop_source stop_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace clothstream::scene
