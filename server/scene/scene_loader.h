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
  // Waits for the worker thread.
  ~SceneLoader() = default;
  SceneLoader(const SceneLoader&) = delete;
  SceneLoader& operator=(const SceneLoader&) = delete;

  // The device must live until the future is ready or wait() has returned. The future throws what the
  // constructor of SceneOnDevice throws, and std::runtime_error soon after a request to stop.
  Future load(vulkan::Device& device, const model::Scene& scene, std::stop_token stop);

  // Returns when the worker thread is idle.
  void wait();

 private:
  codec::Workers& workers_;
  const std::function<void()> done_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace clothstream::scene
