// SPDX-License-Identifier: MIT
// What tests of the endpoints share: a server with small scenes on whatever device there is.
#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "server/hosting/scene_server.h"

namespace clothstream::tests {

// Skips its tests, with the reason, where there is no device. A validation message fails them.
class EndpointTest : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  // Of the scenes "small" (8 x 8 nodes hung by their first row, 30 frames a second), which is the default,
  // and "other".
  hosting::SceneServer& server() { return *server_; }
  // Closes it; every endpoint must be closed.
  void closeServer() { server_.reset(); }

 private:
  std::unique_ptr<hosting::SceneServer> server_;
};

}  // namespace clothstream::tests
