// SPDX-License-Identifier: MIT
// Fixture of the endpoint tests: a server with small scenes on any Vulkan device.
#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "server/hosting/scene_server.h"

namespace clothstream::tests {

// Skips the test, with the reason, if there is no device. A validation message fails the test.
class SmallServer : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  // Options of the server, except for its default scene.
  virtual hosting::ServerOptions options() { return {}; }
  // Scenes: "small" (the default) and "other" with 8 x 8 nodes each, "large" with 128 x 128. Each hangs by
  // two corners and streams 30 frames a second.
  hosting::SceneServer& server() { return *server_; }
  // Destroys the server. Every endpoint must be closed.
  void closeServer() { server_.reset(); }

 private:
  std::unique_ptr<hosting::SceneServer> server_;
};

}  // namespace clothstream::tests
