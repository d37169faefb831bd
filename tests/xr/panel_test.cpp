// SPDX-License-Identifier: MIT
#include "clients/xr/panel/panel.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::xr {
namespace {

using testing::Optional;

PanelFacts sampleFacts(std::size_t scenes = 3) {
  PanelFacts facts;
  facts.scene = "scene_1";
  for (std::size_t i = 0; i < scenes; ++i)
    facts.scenes.push_back({"scene_" + std::to_string(i), static_cast<std::uint32_t>(i)});
  facts.people = {{"Ada", "owner", true}, {"Grace", "viewer", false}};
  facts.figures = {{"round trip", "12.0 ms"}, {"stream", "60 frames/s"}};
  facts.mayAct = true;
  facts.status = "60 frames/s";
  return facts;
}

class PanelTest : public testing::Test {
 protected:
  PanelTest() { panel_.show(sampleFacts()); }

  const PanelArea* find(const std::string& text) const {
    const auto at = std::ranges::find(panel_.buttons(), FixedText(text), &PanelArea::text);
    return at == panel_.buttons().end() ? nullptr : &*at;
  }
  // Ray to the middle of a button of a panel that stands in the room.
  std::optional<PanelHit> hit(const PanelArea& area) const {
    const Eigen::Vector3f local(area.left + area.width / 2 - kPanelWidth / 2, -area.top - area.height / 2, 0);
    const Eigen::Vector3f eye(0.3f, 1.6f, 0.2f);
    return panel_.hit(pose_, eye, (pose_.apply(local) - eye).normalized());
  }
  std::optional<PanelAction> press(const std::string& text) {
    const PanelArea* area = find(text);
    if (area == nullptr) {
      ADD_FAILURE() << "no button " << text;
      return std::nullopt;
    }
    const std::optional<PanelHit> at = hit(*area);
    EXPECT_FALSE(panel_.point(0, at, true));
    return panel_.point(0, at, false);
  }
  bool shows(const std::string& text) const {
    return std::ranges::any_of(panel_.lines(), [&](const PanelLine& line) {
      return line.text.view().find(text) != std::string_view::npos;
    });
  }

  TextPainter painter_;
  Panel panel_{painter_};
  const Pose pose_{{-0.4f, 1.5f, -0.8f},
                   Eigen::Quaternionf(Eigen::AngleAxisf(0.6f, Eigen::Vector3f(0.1f, 1, 0).normalized()))};
};

TEST_F(PanelTest, RaysMeetTheButtonTheyPointAt) {
  for (std::size_t i = 0; i < panel_.buttons().size(); ++i) {
    const std::optional<PanelHit> at = hit(panel_.buttons()[i]);
    ASSERT_TRUE(at);
    EXPECT_EQ(at->button, static_cast<int>(i));
  }
}

TEST_F(PanelTest, HitHasTheDistanceAlongTheRay) {
  const Eigen::Vector3f origin = pose_.apply({0.05f, -0.1f, 0.7f});
  const Eigen::Vector3f direction = pose_.orientation * -Eigen::Vector3f::UnitZ();
  const std::optional<PanelHit> at = panel_.hit(pose_, origin, direction);
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->distance, 0.7f, 1e-5f);
  EXPECT_NEAR(at->place.x(), kPanelWidth / 2 + 0.05f, 1e-5f);
  EXPECT_NEAR(at->place.y(), 0.1f, 1e-5f);
}

TEST_F(PanelTest, RaysFromBehindAndOutsideMiss) {
  const Eigen::Vector3f back = pose_.orientation * Eigen::Vector3f::UnitZ();
  const auto hitAt = [&](float x, float y, float z, const Eigen::Vector3f& direction) {
    return panel_.hit(pose_, pose_.apply({x, y, z}), direction).has_value();
  };
  EXPECT_TRUE(hitAt(0, -0.1f, 0.5f, -back));
  EXPECT_FALSE(hitAt(0, -0.1f, 0.5f, back));   // looks away
  EXPECT_FALSE(hitAt(0, -0.1f, -0.5f, back));  // from behind
  EXPECT_FALSE(hitAt(0.26f, -0.1f, 0.5f, -back));
  EXPECT_FALSE(hitAt(0, 0.01f, 0.5f, -back));
  EXPECT_FALSE(hitAt(0, -panel_.height() - 0.01f, 0.5f, -back));
}

TEST_F(PanelTest, PressOfAButtonAsksForItsAction) {
  EXPECT_THAT(press("Reset"), Optional(PanelAction{PanelActionKind::kReset}));
  EXPECT_THAT(press("Pause"), Optional(PanelAction{PanelActionKind::kPause}));
  EXPECT_THAT(press("scene 2"), Optional(PanelAction{PanelActionKind::kJoinScene, "scene_2"}));
  EXPECT_THAT(press("Leave"), Optional(PanelAction{PanelActionKind::kLeave}));
  EXPECT_THAT(press("Place before me"), Optional(PanelAction{PanelActionKind::kRecenter}));
  EXPECT_EQ(press("Quality"), std::nullopt);
  EXPECT_THAT(press("Quarter"), Optional(PanelAction{PanelActionKind::kQuality, "", 2}));
}

TEST_F(PanelTest, PressThatEndsElsewhereDoesNothing) {
  const std::optional<PanelHit> reset = hit(*find("Reset")), pause = hit(*find("Pause"));
  panel_.point(0, reset, true);
  EXPECT_TRUE(panel_.isHeld(0));
  EXPECT_FALSE(panel_.point(0, pause, true));
  EXPECT_FALSE(panel_.point(0, pause, false));
  EXPECT_FALSE(panel_.isHeld(0));
  // A press that begins outside belongs to something else.
  panel_.point(0, std::nullopt, true);
  EXPECT_FALSE(panel_.isHeld(0));
  panel_.point(0, reset, true);
  EXPECT_FALSE(panel_.point(0, reset, false));
}

TEST_F(PanelTest, PressDoesNotActOnAButtonThatHasMovedUnderIt) {
  const std::optional<PanelHit> scene = hit(*find("scene 2"));
  panel_.point(0, scene, true);
  PanelFacts facts = sampleFacts();
  facts.scenes.insert(facts.scenes.begin(), {"another", 0});
  panel_.show(facts);
  EXPECT_FALSE(panel_.point(0, scene, false));
}

TEST_F(PanelTest, TwoPointersPressIndependently) {
  const std::optional<PanelHit> reset = hit(*find("Reset")), leave = hit(*find("Leave"));
  panel_.point(0, reset, true);
  panel_.point(1, leave, true);
  EXPECT_THAT(panel_.point(0, reset, false), Optional(PanelAction{PanelActionKind::kReset}));
  EXPECT_THAT(panel_.point(1, leave, false), Optional(PanelAction{PanelActionKind::kLeave}));
}

TEST_F(PanelTest, ViewersHaveNoActionsOnTheScene) {
  PanelFacts facts = sampleFacts();
  facts.mayAct = false;
  panel_.show(facts);
  EXPECT_FALSE(find("Reset")->isEnabled);
  EXPECT_EQ(press("Reset"), std::nullopt);
  EXPECT_TRUE(press("scene 2"));
}

TEST_F(PanelTest, FingersPressByGoingThrough) {
  const PanelArea area = *find("Reset");
  const auto tip = [&](float z) {
    return pose_.apply({area.left + area.width / 2 - kPanelWidth / 2, -area.top - area.height / 2, z});
  };
  EXPECT_FALSE(panel_.poke(1, pose_, tip(0.05f)));
  EXPECT_FALSE(panel_.poke(1, pose_, tip(0.01f)));
  EXPECT_THAT(panel_.poke(1, pose_, tip(-0.01f)), Optional(PanelAction{PanelActionKind::kReset}));
  EXPECT_FALSE(panel_.poke(1, pose_, tip(-0.02f)));  // once
  EXPECT_FALSE(panel_.poke(1, pose_, tip(0.02f)));   // from behind
  EXPECT_FALSE(panel_.poke(1, pose_, tip(-0.2f)));   // a jump of a hand that was found again
}

TEST_F(PanelTest, LongListsHavePages) {
  panel_.show(sampleFacts(20));
  EXPECT_EQ(find("scene 19"), nullptr);
  EXPECT_TRUE(shows("1 of 4"));
  EXPECT_FALSE(find("Back")->isEnabled);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(press("More"), std::nullopt);
  EXPECT_TRUE(shows("4 of 4"));
  EXPECT_FALSE(find("More")->isEnabled);
  EXPECT_THAT(press("scene 19"), Optional(PanelAction{PanelActionKind::kJoinScene, "scene_19"}));
  // A shorter list has no such page.
  panel_.show(sampleFacts(2));
  EXPECT_NE(find("scene 1"), nullptr);
}

TEST_F(PanelTest, EverythingIsWithinThePanel) {
  PanelFacts facts = sampleFacts(40);
  facts.status = std::string(60, 'w');
  for (int i = 0; i < 30; ++i) facts.status += " more and more words";
  for (const char* tab : {"People", "Quality", "Figures", "Scenes"}) {
    press(tab);
    panel_.show(facts);
    for (const PanelArea& area : panel_.buttons()) {
      EXPECT_GE(area.left, 0);
      EXPECT_LE(area.left + area.width, kPanelWidth);
      EXPECT_LE(area.top + area.height, panel_.height());
    }
    for (const PanelLine& line : panel_.lines())
      EXPECT_LE(line.top + kPanelRow, kPanelHeight + 1e-4f) << line.text.view();
  }
}

TEST_F(PanelTest, TroubleStandsBeforeEverythingElse) {
  PanelFacts facts = sampleFacts();
  facts.trouble = "The code is wrong";
  facts.advice = "Type the newest code that the server shows.";
  facts.canRetry = true;
  panel_.show(facts);
  EXPECT_TRUE(shows("The code is wrong"));
  EXPECT_TRUE(shows("Type the newest"));
  EXPECT_EQ(find("Reset"), nullptr);
  EXPECT_THAT(press("Try again"), Optional(PanelAction{PanelActionKind::kRetry}));
  panel_.show(sampleFacts());
  EXPECT_FALSE(shows("The code is wrong"));
  EXPECT_NE(find("Reset"), nullptr);
}

TEST_F(PanelTest, PictureChangesOnlyWithWhatItShows) {
  panel_.finish();
  const PanelQuad first = panel_.quad(pose_);
  ASSERT_TRUE(first.visible);
  const std::uint64_t revision = first.picture->revision;
  panel_.show(sampleFacts());
  panel_.finish();
  EXPECT_EQ(panel_.quad(pose_).picture->revision, revision);
  PanelFacts facts = sampleFacts();
  facts.status = "another";
  panel_.show(facts);
  panel_.finish();
  EXPECT_NE(panel_.quad(pose_).picture->revision, revision);
  panel_.point(0, hit(*find("Reset")), false);  // hovers
  panel_.finish();
  EXPECT_NE(panel_.quad(pose_).picture->revision, revision + 1);
}

// Texels of a picture that differ from those of an earlier one lie in its changes.
TEST_F(PanelTest, PicturesSayWhereTheyDifferFromTheOneBefore) {
  panel_.finish();
  const Picture before = *panel_.quad(pose_).picture;
  PanelFacts facts = sampleFacts();
  facts.status = "61 frames/s";
  panel_.show(facts);
  panel_.finish();
  const Picture& after = *panel_.quad(pose_).picture;
  EXPECT_EQ(after.since, before.revision);
  std::size_t changed = 0;
  for (std::uint32_t y = 0; y < after.height; ++y)
    for (std::uint32_t x = 0; x < after.width; ++x) {
      const std::size_t at = 4 * (std::size_t{y} * after.width + x);
      const bool isIn = std::ranges::any_of(after.changes, [&](const TexelRect& rect) {
        return x >= rect.left && x < rect.right && y >= rect.top && y < rect.bottom;
      });
      changed += isIn;
      if (isIn) continue;
      ASSERT_TRUE(std::equal(&after.texels[at], &after.texels[at] + 4, &before.texels[at])) << x << ' ' << y;
    }
  EXPECT_GT(changed, 0U);
  // A digit is less than a hundredth of the panel.
  EXPECT_LT(changed, std::size_t{after.width} * after.height / 100);
}

TEST_F(PanelTest, QuadHangsFromThePose) {
  panel_.finish();
  const PanelQuad quad = panel_.quad(pose_);
  const Eigen::Vector3f top = quad.pose.apply({0, quad.size.y() / 2, 0});
  EXPECT_LT((top - pose_.position).norm(), 1e-5f);
  EXPECT_NEAR(quad.size.x() / quad.size.y(),
              static_cast<float>(quad.picture->width) / static_cast<float>(quad.picture->height), 0.002f);
}

}  // namespace
}  // namespace clothstream::xr
