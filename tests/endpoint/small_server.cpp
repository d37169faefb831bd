// SPDX-License-Identifier: MIT
#include "tests/endpoint/small_server.h"

#include <string>
#include <utility>
#include <vector>

#include "server/telemetry/log.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

model::Scene sheet(std::string name, std::uint32_t side) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {side, side, 1.0f, 1.0f, {}};
  cloth.mass = 0.0015f * static_cast<float>(side * side);
  cloth.structural = {5, 0.001f};
  cloth.shear = {2, 0.001f};
  cloth.bend = {0.5f, 0.001f};
  cloth.damping = 0.5f;
  cloth.pins = {{0, 0, 1, 0, side - 1, 1}};
  model::Scene scene;
  scene.name = std::move(name);
  scene.simulationRate = scene.streamRate = 30;
  scene.stream.qualities = 1;  // so that a slow reader gets the same packets as others
  scene.cloths = {cloth};
  return scene;
}

}  // namespace

void SmallServer::SetUp() {
  telemetry::setUpLog("warning");
  hosting::ServerOptions serverOptions = options();
  serverOptions.budget = {
      .sceneLoad = 1e9, .load = 1e9, .sceneMegabytes = 1e9, .megabytes = 1e9, .tickSeconds = 0};
  serverOptions.defaultScene = "small";
  try {
    server_ = std::make_unique<hosting::SceneServer>(
        std::vector{sheet("small", 8), sheet("other", 8), sheet("large", 128)}, std::move(serverOptions));
  } catch (const vulkan::DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
}

void SmallServer::TearDown() {
  closeServer();
  for (const std::string& text : takeValidationTexts()) ADD_FAILURE() << "Vulkan validation: " << text;
}

}  // namespace clothstream::tests
