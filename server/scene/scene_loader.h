// SPDX-License-Identifier: MIT
// Loads scenes onto the device while other scenes run on it, and prepares their changes.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <stop_token>
#include <type_traits>
#include <utility>

#include <boost/asio/thread_pool.hpp>

#include "server/model/scene.h"
#include "server/scene/scene_on_device.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {

// Does one thing at a time, on a worker thread. Belongs to the device's thread.
class SceneLoader {
 public:
  using Future = std::future<std::unique_ptr<SceneOnDevice>>;

  // `done` is called on the worker thread after everything that it does. `workers` must outlive the loader.
  SceneLoader(codec::Workers& workers, std::function<void()> done);
  // Waits for the worker thread.
  ~SceneLoader() = default;
  SceneLoader(const SceneLoader&) = delete;
  SceneLoader& operator=(const SceneLoader&) = delete;

  // The device must live until the future is ready or wait() has returned. The future throws what the
  // constructor of SceneOnDevice throws, and std::runtime_error soon after a request to stop.
  Future load(vulkan::Device& device, const model::Scene& scene, std::stop_token stop);

  // Loads a scene on the calling thread, as load() does on the worker thread.
  std::unique_ptr<SceneOnDevice> loadNow(vulkan::Device& device, const model::Scene& scene,
                                         const std::stop_token& stop);
  // Runs `work` on the worker thread. The future throws what it throws.
  template <typename Work>
  std::future<std::invoke_result_t<Work>> run(Work work) {
    // Shared, because the destructor of a task that a future waits for allocates memory, and post() may have
    // found none.
    const auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work>()>>(std::move(work));
    std::future<std::invoke_result_t<Work>> result = task->get_future();
    post([task] { (*task)(); });
    return result;
  }

  // Returns when the worker thread is idle.
  void wait();

 private:
  void post(std::function<void()> task);

  codec::Workers& workers_;
  const std::function<void()> done_;
  boost::asio::thread_pool thread_{1};
};

}  // namespace clothstream::scene
