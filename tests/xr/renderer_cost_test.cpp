// SPDX-License-Identifier: MIT
// Allocations of the thread that draws, without validation, which adds its own.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "clients/xr/panel/panel.h"
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

// Facts as the program reads them four times a second. All figures change with `second`.
void readFacts(int second, PanelFacts& facts) {
  facts.scene = "a_scene_with_a_long_name";
  facts.scenes = {{"a_scene_with_a_long_name", 3}, {"flag", 1}};
  facts.people.clear();
  for (const char* name : {"Ada Lovelace", "Grace Hopper"})
    facts.people.push_back({name, "participant", false});
  facts.figures.clear();
  for (const char* name : {"stream", "network", "round trip", "decode"})
    facts.figures.push_back({name, FixedText::format("{:.1f} units", 17.3 * second)});
  facts.status = FixedText::format("{} frames/s, round trip {} ms", 50 + second, 12 * second).view();
}

TEST_F(RendererCostTest, FramesWithFactsThatChangeAllocateNothingAfterWarmUp) {
  Drawn drawn(device(), 64, 2, 4);
  TextPainter painter;
  Stage stage = busyStage(painter);
  Panel panel(painter);
  PanelFacts facts;
  facts.status.reserve(256);
  const std::array<View, 2> eyes{front, front};
  std::uint64_t revision = 0;
  const auto frame = [&](int second) {
    readFacts(second, facts);
    panel.show(facts);
    panel.finish();  // so that each frame has a new picture
    stage.panel = panel.quad({{0, 1, 0}, Eigen::Quaternionf::Identity()});
    EXPECT_NE(stage.panel.picture->revision, std::exchange(revision, stage.panel.picture->revision));
    tests::wave(stage, static_cast<float>(second));
    drawn.draw(stage, eyes);
  };
  frame(0);
  // A press of the tab "Figures", which shows most changes.
  const auto figures = std::ranges::find(panel.buttons(), FixedText("Figures"), &PanelArea::text);
  ASSERT_NE(figures, panel.buttons().end());
  const PanelHit hit{.place = {figures->left + figures->width / 2, figures->top + figures->height / 2}};
  for (const bool isPressed : {true, false}) panel.point(0, hit, isPressed);
  for (int second = 1; second < 5; ++second) frame(second);
  tests::Allocations counted;
  const auto before = std::make_unique<int>(1);
  EXPECT_EQ(counted.count(), 1U);  // shows that allocations are counted
  for (int second = 5; second < 11; ++second) frame(second);
  EXPECT_EQ(counted.count(), 1U);
}

TEST(PanelDrawing, AllocatesNothingWithKnownGlyphs) {
  TextPainter painter;
  PanelDrawing drawing;
  Picture picture;
  const auto draw = [&](int second) {
    drawing.lines.clear();
    drawing.areas.clear();
    drawing.lines.push_back({0.1f, FixedText::format("{} frames/s", second), "detail", false});
    drawing.areas.push_back({.left = 0.1f, .top = 0.2f, .width = 0.1f, .height = 0.05f, .text = "Reset"});
    drawPanel(drawing, painter, picture);
  };
  for (const float size : {kTextSize, kButtonSize, kDetailSize})
    painter.warm(pixelsOf(size), Weight::kRegular);
  draw(1);
  const tests::Allocations counted;
  for (int second = 2; second < 50; ++second) draw(second);
  EXPECT_EQ(counted.count(), 0U);
}

}  // namespace
}  // namespace clothstream::xr
