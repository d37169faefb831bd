// SPDX-License-Identifier: MIT
// Fixture: servers and edges of one fleet in this process, with Debian's nats-server.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/fleet/edge.h"
#include "server/fleet/origin.h"
#include "server/hosting/scene_server.h"
#include "tests/fleet/nats_server.h"
#include "tests/serving/small_scene.h"
#include "tests/serving/test_peer.h"
#include "tests/support/eventually.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {

// Skips the test, with the reason, if there is no device or no nats-server.
class FleetTest : public ::testing::Test {
 protected:
  void SetUp() override {
    nats_ = NatsServer::start();
    if (!nats_) GTEST_SKIP() << "there is no nats-server (apt install nats-server)";
    try {
      const hosting::SceneServer probe({smallScene("small")}, options());
    } catch (const vulkan::DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  fleet::NatsOptions natsOptions() const {
    return {.servers = {nats_->url()}, .credentials = {}, .authority = {}, .name = "test", .role = "test"};
  }
  static hosting::ServerOptions options() {
    hosting::ServerOptions options;
    options.defaultScene = "small";
    options.guestScenes = {"other"};
    options.budget = {
        .sceneLoad = 1e9, .load = 1e9, .sceneMegabytes = 1e9, .megabytes = 1e9, .tickSeconds = 0};
    return options;
  }

  // A server with the scenes "small" and "other".
  struct OriginServer {
    OriginServer(const fleet::NatsOptions& nats, hosting::ServerOptions serverOptions,
                 fleet::OriginOptions originOptions = {})
        : server({smallScene("small"), smallScene("other")}, std::move(serverOptions)),
          origin(std::make_unique<fleet::Origin>(server, nats, std::move(originOptions))) {}
    ~OriginServer() { server.stop(); }

    std::shared_ptr<scene::LiveScene> find(const std::string& scene) { return server.scenes.find(scene); }
    // Creates a copy of "other". Returns why not; empty if it worked.
    std::string create(const std::string& name) {
      v1::CreateSceneRequest request;
      request.set_named("other");
      request.set_name(name);
      return problemOf([&](const auto& done) { server.unaryCalls.createScene(request, done); });
    }
    // The same for its end.
    std::string remove(const std::string& name) {
      v1::DeleteSceneRequest request;
      request.set_name(name);
      return problemOf([&](const auto& done) { server.unaryCalls.deleteScene(request, done); });
    }
    // Whether the directory says that this server has the scene, and can be asked to move it.
    bool owns(const std::string& scene) { return origin->directory().owns(scene); }

    hosting::SceneServer server;
    std::unique_ptr<fleet::Origin> origin;

   private:
    // Starts something, and waits for its result.
    static std::string problemOf(const auto& start) {
      std::string problem = "no answer";
      std::atomic<bool> done = false;
      start([&](const auto& result) {
        problem = result ? "" : result.error().text();
        done = true;
      });
      EXPECT_TRUE(eventually([&] { return done.load(); }));
      return problem;
    }
  };
  std::unique_ptr<OriginServer> startOrigin(fleet::OriginOptions originOptions = {}) {
    return std::make_unique<OriginServer>(natsOptions(), options(), std::move(originOptions));
  }

  struct EdgeServer {
    EdgeServer(const fleet::NatsOptions& nats) : server(hosting::ServerOptions{}), edge(server, nats, keep) {}
    ~EdgeServer() { server.stop(); }
    bool shows(const std::string& scene) { return server.scenes.find(scene) != nullptr; }

    static constexpr std::chrono::seconds keep{60};
    hosting::SceneServer server;
    fleet::Edge edge;
  };
  std::unique_ptr<EdgeServer> startEdge(const std::string& scene) {
    auto started = std::make_unique<EdgeServer>(natsOptions());
    EXPECT_TRUE(eventually([&] { return started->shows(scene); }));
    return started;
  }

  std::unique_ptr<NatsServer> nats_;
};

}  // namespace clothstream::tests
