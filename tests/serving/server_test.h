// SPDX-License-Identifier: MIT
// Fixture: a server with small scenes on the available device, tested through its peers.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/hosting/scene_server.h"
#include "tests/serving/small_scene.h"
#include "tests/serving/test_peer.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {

// Skips the test, with the reason, if there is no device.
class ServerTest : public ::testing::Test {
 protected:
  // Load and memory without a limit.
  static constexpr scene::BudgetLimits kNoLimits{
      .sceneLoad = 1e9, .load = 1e9, .sceneMegabytes = 1e9, .megabytes = 1e9, .tickSeconds = 0};

  // Starts the server with the scenes "small" (the default), "other" and `more`. Call it once per test.
  void start(hosting::ServerOptions options = {}, const std::vector<model::Scene>& more = {},
             const scene::BudgetLimits& budget = kNoLimits) {
    options.defaultScene = "small";
    options.budget = budget;
    std::vector scenes{smallScene("small"), smallScene("other")};
    scenes.insert(scenes.end(), more.begin(), more.end());
    try {
      server_ = std::make_unique<hosting::SceneServer>(std::move(scenes), std::move(options));
    } catch (const vulkan::DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  hosting::SceneServer& server() { return *server_; }
  void stop() { server_.reset(); }
  telemetry::SceneMetrics& metrics() { return server_->scenes.all().front()->metrics; }

 private:
  std::unique_ptr<hosting::SceneServer> server_;
};

}  // namespace clothstream::tests
