// SPDX-License-Identifier: MIT
// Pictures of a stage without a server, by their properties. CLOTHSTREAM_XR_PICTURES names a folder for
// copies to look at.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <gtest/gtest.h>

#include "clients/xr/render/light.h"
#include "clients/xr/stage/solids.h"
#include "clients/xr/text/painter.h"
#include "tests/xr/drawn.h"
#include "tests/xr/sample_stage.h"

namespace clothstream::xr {
namespace {

using tests::Drawn;
using tests::look;
using tests::sampleStage;

constexpr std::uint32_t kSide = 40;  // nodes along the edges of a sheet

Eigen::Vector3f nodeOf(const Stage& stage, std::uint32_t node) {
  return Eigen::Map<const Eigen::Vector3f>(&stage.positions[3 * std::size_t{node}]);
}

bool isOnEdge(std::uint32_t node) {
  const std::uint32_t row = node / kSide, column = node % kSide;
  return row == 0 || column == 0 || row + 1 == kSide || column + 1 == kSide;
}

class RendererTest : public testing::Test {
 protected:
  // Drivers compile shaders once per device.
  static void SetUpTestSuite() { device_ = std::make_unique<tests::Device>(); }
  static void TearDownTestSuite() { device_.reset(); }
  void SetUp() override {
    if (!device_->get()) GTEST_SKIP() << "no Vulkan device: " << device_->why();
    messages_ = validationMessages();
  }
  void TearDown() override { EXPECT_EQ(validationMessages(), messages_) << "messages of validation"; }

  const GraphicsDevice& device() const { return device_->graphics(); }
  static void keep(const Drawn& drawn, const std::string& name, std::uint32_t views = 1) {
    const char* folder = std::getenv("CLOTHSTREAM_XR_PICTURES");
    if (folder == nullptr) return;
    for (std::uint32_t view = 0; view < views; ++view)
      writePng(std::filesystem::path(folder) / (name + std::to_string(view) + ".png"), drawn.target().size(),
               drawn.target().pixels(view), true);
  }
  // Stage without its cloth.
  static Stage bare(const Stage& stage) {
    Stage without = stage;
    without.parts.clear();
    return without;
  }

  static inline std::unique_ptr<tests::Device> device_;
  std::uint64_t messages_ = 0;
  const std::array<View, 1> front_{look({0.3f, 1.3f, 2.2f}, {0, 1, 0})};
};

TEST_F(RendererTest, ClothCoversThePixelsOfItsVertices) {
  Drawn drawn(device(), 256, 1);
  Stage stage = sampleStage(kSide);
  tests::wave(stage, 1);
  drawn.draw(bare(stage), front_);
  const std::vector<std::uint8_t> empty = drawn.pixels();
  drawn.draw(stage, front_);
  keep(drawn, "cloth");
  const std::vector<std::uint8_t> full = drawn.pixels();
  std::vector<bool> near(256 * 256, false);  // pixels near a vertex
  for (std::uint32_t node = 0; node < stage.nodeCount; ++node) {
    const auto place = drawn.placeOf(nodeOf(stage, node), front_[0]);
    ASSERT_TRUE(place);
    for (std::uint32_t y = place->y - 6; y <= place->y + 6; ++y)
      for (std::uint32_t x = place->x - 6; x <= place->x + 6; ++x) near[256 * y + x] = true;
    if (isOnEdge(node)) continue;  // can be just beside the covered pixels
    const std::size_t at = 256 * place->y + place->x;
    EXPECT_FALSE(std::equal(&full[4 * at], &full[4 * at + 3], &empty[4 * at])) << node;
    EXPECT_NEAR(drawn.depthAt(place->x, place->y), place->depth, 0.003f) << node;
  }
  // Everything else that is drawn is the floor.
  const Eigen::Matrix4f back = (front_[0].projection * front_[0].view).inverse();
  const auto ndc = [](std::uint32_t pixel) { return 2 * (static_cast<float>(pixel) + 0.5f) / 256 - 1; };
  for (std::uint32_t y = 0; y < 256; ++y)
    for (std::uint32_t x = 0; x < 256; ++x) {
      if (near[256 * y + x] || drawn.depthAt(x, y) == 1) continue;
      const Eigen::Vector4f place = back * Eigen::Vector4f(ndc(x), ndc(y), drawn.depthAt(x, y), 1);
      EXPECT_NEAR(place.y() / place.w(), 0, 0.02f) << x << ' ' << y;
    }
}

TEST_F(RendererTest, EyesDifferByTheParallaxOfTheGeometry) {
  constexpr std::uint32_t kSize = 512;
  constexpr float kBetweenEyes = 0.064f;
  Drawn drawn(device(), kSize, 2);
  Stage stage = sampleStage(kSide);
  tests::wave(stage, 0);
  // Eyes of a head that looks along -Z.
  std::array<View, 2> eyes{look({-kBetweenEyes / 2, 1, 1.6f}, {-kBetweenEyes / 2, 1, 0}),
                           look({kBetweenEyes / 2, 1, 1.6f}, {kBetweenEyes / 2, 1, 0})};
  drawn.draw(stage, eyes);
  keep(drawn, "eyes", 2);
  for (std::uint32_t node = 0; node < stage.nodeCount; ++node) {
    const Eigen::Vector3f point = nodeOf(stage, node);
    const auto left = drawn.placeOf(point, eyes[0]), right = drawn.placeOf(point, eyes[1]);
    ASSERT_TRUE(left && right);
    EXPECT_EQ(left->y, right->y);
    // Disparity in pixels: focal length times distance of the eyes by depth.
    const float disparity = static_cast<float>(kSize) / (2 * 0.5f) * kBetweenEyes / (1.6f - point.z());
    EXPECT_NEAR(static_cast<float>(left->x) - static_cast<float>(right->x), disparity, 1.01f);
    if (isOnEdge(node)) continue;
    EXPECT_NEAR(drawn.depthAt(left->x, left->y, 0), left->depth, 2e-3f) << node;
    EXPECT_NEAR(drawn.depthAt(right->x, right->y, 1), right->depth, 2e-3f) << node;
  }
  EXPECT_NE(drawn.pixels(0), drawn.pixels(1));
}

TEST_F(RendererTest, OneEyeOfTwoIsTheSameAsAlone) {
  Drawn alone(device(), 128, 1), pair(device(), 128, 2);
  const Stage stage = sampleStage(20);
  const std::array<View, 2> both{front_[0], look({0.4f, 1.3f, 2.2f}, {0, 1, 0})};
  alone.draw(stage, front_);
  pair.draw(stage, both);
  EXPECT_EQ(alone.pixels(), pair.pixels(0));
}

TEST_F(RendererTest, SamplesSmoothEdges) {
  Drawn rough(device(), 128, 1, 1), smooth(device(), 128, 1, 4);
  const Stage stage = sampleStage(20);
  rough.draw(stage, front_);
  smooth.draw(stage, front_);
  keep(smooth, "samples");
  std::size_t same = 0;
  for (std::uint32_t y = 0; y < 128; ++y)
    for (std::uint32_t x = 0; x < 128; ++x)
      same += std::abs(rough.at(x, y).brightness() - smooth.at(x, y).brightness()) < 30;
  EXPECT_GT(same, 128U * 128 * 93 / 100);
  EXPECT_NE(rough.pixels(), smooth.pixels());
  // The resolved depth is that of the cloth.
  const auto middle = smooth.placeOf({0, 1, 0}, front_[0]);
  EXPECT_NEAR(smooth.depthAt(middle->x, middle->y), middle->depth, 1e-3f);
}

TEST_F(RendererTest, ClothCastsItsShadowOnTheFloor) {
  Drawn drawn(device(), 256, 1);
  const Stage stage = sampleStage(20);
  // From above, on the floor behind the cloth, where the shadow of its middle is.
  const Eigen::Vector3f light = keyDirection();
  const Eigen::Vector3f shadow = Eigen::Vector3f(0, 1, 0) - light / light.y();
  const std::array<View, 1> above{look(shadow + Eigen::Vector3f(-1.5f, 2.5f, -1), shadow, 0.4f)};
  drawn.draw(bare(stage), above);
  const auto place = drawn.placeOf(shadow, above[0]);
  const int lit = drawn.at(place->x, place->y).brightness();
  const int cornerBefore = drawn.at(250, 250).brightness();
  drawn.draw(stage, above);
  keep(drawn, "shadow");
  EXPECT_LT(drawn.at(place->x, place->y).brightness(), lit * 85 / 100);
  EXPECT_NEAR(drawn.at(250, 250).brightness(), cornerBefore, 6);
}

// A woven sheet in waves, in light that grazes some of them, has no single pixel that is much brighter or
// darker than all four around it. Such dots were at edges of triangles, where derivatives were wrong.
TEST_F(RendererTest, NoPixelOfClothStandsOut) {
  Drawn drawn(device(), 256, 1);
  Stage stage = sampleStage(kSide);
  tests::wave(stage, 1);
  const std::array<View, 1> near{look({0.2f, 1.1f, 1.2f}, {0, 1, 0}, 0.3f)};  // the sheet fills the picture
  drawn.draw(stage, near);
  keep(drawn, "smooth");
  int most = 0;
  for (std::uint32_t y = 1; y < 255; ++y)
    for (std::uint32_t x = 1; x < 255; ++x) {
      const int here = drawn.at(x, y).brightness();
      int above = 765, below = 765;  // least differences from those around
      for (const auto& [column, row] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
        const int difference = here - drawn.at(column, row).brightness();
        above = std::min(above, difference);
        below = std::min(below, -difference);
      }
      most = std::max({most, above, below});
    }
  EXPECT_LT(most, 30);
}

TEST_F(RendererTest, ClothHasTwoSides) {
  Drawn drawn(device(), 128, 1);
  Stage stage = sampleStage(20);
  stage.parts[0].surface = surfaceOf("denim", 0);  // its back is paler
  stage.parts[0].surface.woven = false;
  const std::array<View, 1> fromFront{look({0, 1, 2}, {0, 1, 0})}, fromBack{look({0, 1, -2}, {0, 1, 0})};
  drawn.draw(stage, fromFront);
  const Drawn::Pixel front = drawn.at(64, 64);
  stage.parts[0].surface.reverse = 1;
  drawn.draw(stage, fromBack);
  const Drawn::Pixel sameBack = drawn.at(64, 64);
  stage.parts[0].surface.reverse = 1.7f;
  drawn.draw(stage, fromBack);
  const Drawn::Pixel back = drawn.at(64, 64);
  keep(drawn, "back");
  EXPECT_GT(front.blue, front.red);
  EXPECT_GT(back.blue, back.red);
  EXPECT_GT(back.brightness(), sameBack.brightness() + 10);
  // The key light is on the front.
  EXPECT_GT(front.brightness(), sameBack.brightness());
}

TEST_F(RendererTest, PassThroughIsTransparentExceptForWhatIsDrawn) {
  Drawn drawn(device(), 128, 1);
  Stage stage = sampleStage(20);
  stage.background = Background::kTransparent;
  drawn.draw(stage, front_);
  keep(drawn, "transparent");
  const auto middle = drawn.placeOf({0, 1, 0}, front_[0]);
  EXPECT_EQ(drawn.at(middle->x, middle->y).alpha, 255);
  EXPECT_EQ(drawn.at(5, 5), (Drawn::Pixel{0, 0, 0, 0}));
  // The shadow darkens the real floor.
  const Eigen::Vector3f light = keyDirection();
  const auto shade = drawn.placeOf(Eigen::Vector3f(0, 0.6f, 0) - 0.6f * light / light.y(), front_[0]);
  ASSERT_TRUE(shade);
  const Drawn::Pixel shadow = drawn.at(shade->x, shade->y);
  EXPECT_GT(shadow.alpha, 40);
  EXPECT_EQ(shadow.brightness(), 0);
  // Real hands hide the cloth.
  Solid hand;
  hand.radius = hand.topRadius = 0.2f;
  hand.pose.position = {0, 1, 0.4f};
  hand.hidesOnly = true;
  stage.own.push_back(hand);
  drawn.draw(stage, front_);
  const auto inHand = drawn.placeOf(hand.pose.position, front_[0]);
  EXPECT_EQ(drawn.at(inHand->x, inHand->y), (Drawn::Pixel{0, 0, 0, 0}));
}

TEST_F(RendererTest, AdditiveDisplaysGetBlackWhereNothingIs) {
  Drawn drawn(device(), 64, 1);
  Stage stage = sampleStage(10);
  stage.background = Background::kAdditive;
  drawn.draw(stage, front_);
  EXPECT_EQ(drawn.at(2, 2).brightness(), 0);
  EXPECT_EQ(drawn.at(32, 60).brightness(), 0);
}

TEST_F(RendererTest, SolidsAreWhereTheirPosesSay) {
  Drawn drawn(device(), 256, 1);
  Stage stage = bare(sampleStage(4));
  Solid box;
  box.kind = SolidKind::kBox;
  box.substance = Substance::kPlaster;
  box.size = {0.3f, 0.2f, 0.1f};
  box.pose.position = {-0.5f, 1, 0};
  Solid ball;
  ball.substance = Substance::kCeramic;
  ball.radius = ball.topRadius = 0.15f;
  ball.pose.position = {0.5f, 1.2f, 0};
  ball.roughness = 0.16f;
  Solid tapered;
  tapered.substance = Substance::kWood;
  tapered.radius = 0.15f;
  tapered.topRadius = 0.05f;
  tapered.length = 0.4f;
  tapered.pose.position = {0, 0.8f, 0};
  tapered.colour = fromSrgb(0x6e4a2f);
  stage.solids = {box, ball, tapered};
  const std::array<View, 1> view{look({0, 1, 2}, {0, 1, 0})};
  drawn.draw(stage, view);
  keep(drawn, "solids");
  const float scale = 256 / (2 * 0.5f);
  // Surface before each middle: distance of the front of the solid.
  const auto distanceAt = [&](const Eigen::Vector3f& middle) {
    const auto place = drawn.placeOf(middle, view[0]);
    const float depth = drawn.depthAt(place->x, place->y);
    return 0.05f * 50 / (50 - depth * (50 - 0.05f));
  };
  EXPECT_NEAR(distanceAt({-0.5f, 1, 0.05f}), 1.95f, 0.01f);
  EXPECT_NEAR(distanceAt({0.5f, 1.2f, 0.15f}), 1.85f, 0.02f);
  // The capsule is wider at its lower end.
  const auto widthAt = [&](float y) {
    const auto row = drawn.placeOf({0, y, 0}, view[0])->y;
    std::uint32_t width = 0;
    for (std::uint32_t x = 90; x < 166; ++x) {
      const float depth = drawn.depthAt(x, row);
      width += 0.05f * 50 / (50 - depth * (50 - 0.05f)) < 2.1f;
    }
    return static_cast<float>(width) * 2 / scale;
  };
  EXPECT_NEAR(widthAt(0.6f), 0.3f, 0.03f);
  EXPECT_NEAR(widthAt(1.0f), 0.11f, 0.03f);
}

TEST_F(RendererTest, PanelAndNamesShowTheirTexels) {
  Drawn drawn(device(), 256, 1);
  Stage stage = bare(sampleStage(4));
  Picture picture;
  clear(picture, 100, 200);
  drawRounded(picture, 0, 0, 100, 100, 0, {200, 40, 40, 255});    // upper half
  drawRounded(picture, 0, 100, 100, 100, 0, {40, 40, 200, 255});  // lower half
  touch(picture);
  stage.panel = {.visible = true,
                 .pose = {{0, 1, 0}, Eigen::Quaternionf::Identity()},
                 .size = {0.5f, 1},
                 .picture = &picture};
  TextPainter painter;
  stage.labels.push_back({7, {0.6f, 1.2f, 0}, painter.label("Ada Lovelace", {0, 255, 0, 255})});
  const std::array<View, 1> view{look({0, 1, 2}, {0, 1, 0})};
  drawn.draw(stage, view);
  keep(drawn, "panel");
  // Colours are neither tone mapped nor lit.
  EXPECT_NEAR(drawn.at(128, 90).red, 200, 2);
  EXPECT_NEAR(drawn.at(128, 90).blue, 40, 2);
  EXPECT_NEAR(drawn.at(128, 166).blue, 200, 2);
  // The dark ground of the name, and its letters.
  const auto name = drawn.placeOf({0.6f, 1.2f, 0}, view[0]);
  int least = 765, most = 0;
  for (std::uint32_t x = name->x - 12; x < name->x + 12; ++x) {
    least = std::min(least, drawn.at(x, name->y).brightness());
    most = std::max(most, drawn.at(x, name->y).brightness());
  }
  EXPECT_LT(least, 350);  // the room is brighter
  EXPECT_GT(most, least + 150);
  // Another picture replaces the first.
  drawRounded(picture, 0, 0, 100, 200, 0, {30, 160, 30, 255});
  touch(picture);
  drawn.draw(stage, view);
  EXPECT_NEAR(drawn.at(128, 90).green, 160, 2);
}

TEST_F(RendererTest, ChangesOfThePanelGiveTheSamePictureAsAllOfIt) {
  Drawn one(device(), 256, 1), other(device(), 256, 1);
  Stage stage = bare(sampleStage(4));
  Picture before, after;
  clear(before, 300, 400);
  drawRounded(before, 0, 0, 300, 400, 20, {200, 40, 40, 255});
  after = before;
  touch(before);
  drawRounded(after, 31, 45, 77, 40, 5, {40, 40, 200, 255});
  drawRounded(after, 200, 333, 99, 60, 5, {40, 200, 40, 255});
  touch(after);
  findChanges(before, after);
  ASSERT_GT(after.changes.size(), 2U);
  const std::array<View, 1> view{look({0, 1, 2}, {0, 1, 0})};
  stage.panel = {.visible = true,
                 .pose = {{0, 1, 0}, Eigen::Quaternionf::Identity()},
                 .size = {0.75f, 1},
                 .picture = &before};
  one.draw(stage, view);
  const std::vector<std::uint8_t> first = one.pixels();
  stage.panel.picture = &after;
  one.draw(stage, view);
  EXPECT_NE(one.pixels(), first);
  other.draw(stage, view);  // has not seen the picture before: copies everything
  EXPECT_EQ(one.pixels(), other.pixels());
  // Without changes there is nothing to copy.
  Picture same = after;
  touch(same);
  findChanges(after, same);
  stage.panel.picture = &same;
  one.draw(stage, view);
  EXPECT_EQ(one.pixels(), other.pixels());
}

TEST_F(RendererTest, MoreNamesThanLayersDoNotDisplaceEachOther) {
  Drawn drawn(device(), 128, 1);
  Stage stage = bare(sampleStage(4));
  TextPainter painter;
  for (std::uint64_t id = 1; id <= 40; ++id)
    stage.labels.push_back(
        {id,
         {0.1f * static_cast<float>(id % 8) - 0.4f, 0.6f + 0.1f * static_cast<float>(id / 8), 0},
         painter.label(std::to_string(id), {})});
  for (int frame = 0; frame < 12; ++frame) drawn.draw(stage, front_);  // four names are copied in each
  const std::vector<std::uint8_t> settled = drawn.pixels();
  for (int frame = 0; frame < 3; ++frame) {
    drawn.draw(stage, front_);
    EXPECT_EQ(drawn.pixels(), settled);
  }
  // Layers of names that are gone are used again.
  stage.labels.erase(stage.labels.begin(), stage.labels.begin() + 10);
  Drawn other(device(), 128, 1);
  for (int frame = 0; frame < 12; ++frame) {
    drawn.draw(stage, front_);
    other.draw(stage, front_);
  }
  EXPECT_EQ(drawn.pixels(), other.pixels());
}

TEST_F(RendererTest, NormalsOfTheStreamReplaceComputedOnes) {
  Drawn drawn(device(), 64, 1);
  Stage stage = sampleStage(10);
  stage.parts[0].surface.translucency = 0;
  const std::array<View, 1> view{look({0, 1, 2}, {0, 1, 0})};
  drawn.draw(stage, view);
  const int computed = drawn.at(32, 32).brightness();
  for (std::uint32_t i = 0; i < stage.nodeCount; ++i) stage.normals.insert(stage.normals.end(), {0, 0, 1});
  drawn.draw(stage, view);
  EXPECT_NEAR(drawn.at(32, 32).brightness(), computed, 3);
  const Eigen::Vector3f away = Eigen::Vector3f(-1, -1, 0.3f).normalized();  // from the light
  for (std::uint32_t i = 0; i < stage.nodeCount; ++i) std::copy_n(away.data(), 3, &stage.normals[3 * i]);
  drawn.draw(stage, view);
  EXPECT_LT(drawn.at(32, 32).brightness(), computed - 40);
}

TEST_F(RendererTest, NewTopologyReplacesTheFormer) {
  Drawn drawn(device(), 64, 1);
  const Stage small = sampleStage(4);
  Stage large = sampleStage(60);
  large.topology = 2;
  drawn.draw(small, front_);
  const std::vector<std::uint8_t> before = drawn.pixels();
  drawn.draw(large, front_);
  drawn.draw(small, front_);
  EXPECT_EQ(drawn.pixels(), before);
}

TEST_F(RendererTest, StageWithoutClothsNeedsNoUpload) {
  Drawn drawn(device(), 64, 1);
  Stage stage;
  stage.frames.emplace_back();
  drawn.draw(stage, front_);
  EXPECT_GT(drawn.at(32, 10).brightness(), 300);  // the room
}

TEST(Projection, ShowsTheTangentsAtTheEdges) {
  const Eigen::Matrix4f matrix = projectionOf(-0.9f, 0.7f, 0.8f, -1.1f, 0.1f, 40);
  const auto ndc = [&](float x, float y, float z) -> Eigen::Vector3f {
    const Eigen::Vector4f clip = matrix * Eigen::Vector4f(x, y, z, 1);
    return clip.head<3>() / clip.w();
  };
  EXPECT_LT((ndc(-0.9f * 3, 0.8f * 3, -3).head<2>() - Eigen::Vector2f(-1, -1)).norm(), 1e-5f);  // upper left
  EXPECT_LT((ndc(0.7f * 3, -1.1f * 3, -3).head<2>() - Eigen::Vector2f(1, 1)).norm(), 1e-5f);    // lower right
  EXPECT_NEAR(ndc(0, 0, -0.1f).z(), 0, 1e-5f);
  EXPECT_NEAR(ndc(0, 0, -40).z(), 1, 1e-5f);
}

TEST(ShadowMatrix, CoversTheSphere) {
  const Eigen::Matrix4f matrix = shadowMatrix({1, 2, 3}, 0.7f);
  for (float angle = 0; angle < 6; angle += 0.5f)
    for (float tilt = -1.5f; tilt < 1.5f; tilt += 0.5f) {
      const Eigen::Vector3f point =
          Eigen::Vector3f(1, 2, 3) + 0.7f * Eigen::Vector3f(std::cos(angle) * std::cos(tilt), std::sin(tilt),
                                                            std::sin(angle) * std::cos(tilt));
      const Eigen::Vector4f place = matrix * point.homogeneous();
      for (int i = 0; i < 3; ++i) {
        EXPECT_GT(place[i], 0.02f);
        EXPECT_LT(place[i], 0.98f);
      }
    }
  // Farther from the light is deeper.
  const Eigen::Vector3f middle(1, 2, 3);
  const Eigen::Vector3f behind = middle - 0.3f * keyDirection();
  EXPECT_GT((matrix * behind.homogeneous()).z(), (matrix * middle.homogeneous()).z());
}

}  // namespace
}  // namespace clothstream::xr
