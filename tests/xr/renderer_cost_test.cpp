// SPDX-License-Identifier: MIT
// Allocations of the renderer's thread, without validation, which adds its own.
#include <array>
#include <cstdint>
#include <memory>

#include <gtest/gtest.h>

#include "clients/xr/stage/solids.h"
#include "clients/xr/text/painter.h"
#include "tests/xr/allocations.h"
#include "tests/xr/drawn.h"
#include "tests/xr/sample_stage.h"

namespace clothstream::xr {
namespace {

using tests::Drawn;
using tests::look;
using tests::sampleStage;

const View front = look({0.3f, 1.3f, 2.2f}, {0, 1, 0});

class RendererCostTest : public testing::Test {
 protected:
  // Drivers compile shaders once per device.
  static void SetUpTestSuite() { device_ = std::make_unique<tests::Device>(); }
  static void TearDownTestSuite() { device_.reset(); }
  void SetUp() override {
    if (!device_->get()) GTEST_SKIP() << "no Vulkan device: " << device_->why();
  }
  const GraphicsDevice& device() const { return device_->graphics(); }

  static inline std::unique_ptr<tests::Device> device_;
};

// Stage with 10,000 vertices, two hands, and three other people.
Stage busyStage(TextPainter& painter) {
  Stage stage = sampleStage(100);
  std::array<float, 104> joints{};
  for (std::size_t joint = 0; joint < 26; ++joint) {
    joints[4 * joint] = 0.01f * static_cast<float>(joint);
    joints[4 * joint + 1] = 1;
    joints[4 * joint + 2] = 0.3f;
    joints[4 * joint + 3] = 0.01f;
  }
  for (int hand = 0; hand < 2; ++hand) addHand(joints.data(), colourOf(1), false, stage.own);
  for (std::uint64_t person = 2; person < 5; ++person) {
    for (int hand = 0; hand < 2; ++hand) addHand(joints.data(), colourOf(person), false, stage.solids);
    stage.labels.push_back(
        {person, {0.3f * static_cast<float>(person) - 1, 1.8f, 0}, painter.label("person", {})});
  }
  return stage;
}

TEST_F(RendererCostTest, RecordsWithoutAllocationAfterWarmUp) {
  Drawn drawn(device(), 64, 2, 4);
  TextPainter painter;
  Stage stage = busyStage(painter);
  const std::array<View, 2> eyes{front, front};
  for (int frame = 0; frame < 5; ++frame) drawn.draw(stage, eyes);
  tests::Allocations counted;
  const auto before = std::make_unique<int>(1);
  EXPECT_EQ(counted.count(), 1U);  // shows that allocations are counted
  for (int frame = 0; frame < 6; ++frame) {
    tests::wave(stage, static_cast<float>(frame));
    drawn.draw(stage, eyes);
  }
  EXPECT_EQ(counted.count(), 1U);
}

}  // namespace
}  // namespace clothstream::xr
