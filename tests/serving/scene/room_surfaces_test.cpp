// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of participants: their share, their order, and their way into the ticks.
#include "server/scene/room_surfaces.h"

#include <cmath>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/surface_maker.h"
#include "server/hosting/upload_budget.h"
#include "tests/model/surfaces.h"
#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

simulation::SharedSurface squares(std::uint32_t cells) {
  return simulation::makeSurfaceTable(model::surfaceOf(model::flat(4, 4, cells)));
}

model::Pose at(float y) {
  return {model::Vec3(0, y, 0), model::Quaternion::Identity()};
}

class RoomSurfacesTest : public ::testing::Test {
 protected:
  RoomSurfacesTest() {
    for (const std::uint64_t participant : {9, 7}) surfaces.add(participant, Role::participant);
  }
  RoomSurfaces::Ticket begin(std::uint64_t participant, std::uint32_t id, float y = 0) {
    return surfaces.begin(participant, id, at(y), {}).value();
  }
  messages::Result<void> put(std::uint64_t participant, std::uint32_t id, simulation::SharedSurface table,
                             float y = 0) {
    return surfaces.put(begin(participant, id, y), std::move(table), false, 1);
  }
  // "participant:id triangles at height", in their order.
  std::vector<std::string> taken() {
    std::vector<RoomSurface> all;
    std::uint64_t any = 0;
    surfaces.take(any, all);
    std::vector<std::string> texts;
    for (const RoomSurface& one : all)
      texts.push_back(fmt::format("{}:{} {} at {}", one.participant, one.id,
                                  one.placed.table->surface.triangles.size(), one.placed.pose.position.y()));
    return texts;
  }
  RoomSurfaces surfaces;
};

TEST_F(RoomSurfacesTest, AreOrderedByParticipantAndIdWhateverArrivesFirst) {
  ASSERT_TRUE(put(9, 2, squares(1)));
  ASSERT_TRUE(put(7, 5, squares(2)));
  ASSERT_TRUE(put(9, 1, squares(3)));
  EXPECT_THAT(taken(), ElementsAre("7:5 8 at 0", "9:1 18 at 0", "9:2 2 at 0"));
}

TEST_F(RoomSurfacesTest, AreTakenOnlyWhenTheyHaveChanged) {
  std::uint64_t version = 0;
  std::vector<RoomSurface> all;
  EXPECT_TRUE(surfaces.take(version, all));
  EXPECT_FALSE(surfaces.take(version, all));
  ASSERT_TRUE(put(7, 1, squares(1)));
  EXPECT_TRUE(surfaces.take(version, all));
  static_cast<void>(begin(7, 1));  // changes nothing yet
  EXPECT_FALSE(surfaces.take(version, all));
  ASSERT_TRUE(surfaces.move(7, 1, at(3)));
  EXPECT_TRUE(surfaces.take(version, all));
}

TEST_F(RoomSurfacesTest, AMeshReplacesTheFormerOneWhenItIsComplete) {
  ASSERT_TRUE(put(7, 1, squares(1)));
  const RoomSurfaces::Ticket ticket = begin(7, 1, 2);
  EXPECT_THAT(taken(), ElementsAre("7:1 2 at 0"));
  ASSERT_TRUE(surfaces.move(7, 1, at(5)));  // both of them
  EXPECT_THAT(taken(), ElementsAre("7:1 2 at 5"));
  ASSERT_TRUE(surfaces.put(ticket, squares(2), true, 1));
  EXPECT_THAT(taken(), ElementsAre("7:1 8 at 5"));
}

TEST_F(RoomSurfacesTest, DropAMeshWhoseSurfaceHasANewerOneOrIsGone) {
  const RoomSurfaces::Ticket old = begin(7, 1), removed = begin(7, 2), cancelled = begin(7, 3);
  const RoomSurfaces::Ticket newer = begin(7, 1);
  surfaces.remove(7, 2);
  surfaces.cancel(cancelled);
  for (const RoomSurfaces::Ticket& late : {old, removed, cancelled})
    EXPECT_TRUE(surfaces.put(late, squares(1), false, 1));
  EXPECT_THAT(taken(), IsEmpty());
  ASSERT_TRUE(surfaces.put(newer, squares(2), false, 1));
  const RoomSurfaces::Ticket last = begin(7, 1);
  surfaces.remove(7);
  EXPECT_TRUE(surfaces.put(last, squares(1), false, 1));
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(RoomSurfacesTest, LeaveHalfOfTheRoomToTheNextParticipant) {
  EXPECT_EQ(surfaces.roomOf(7), 50'000u);
  ASSERT_TRUE(put(7, 1, squares(150)));  // 45,000
  EXPECT_EQ(surfaces.roomOf(9), 27'500u);
  const auto refused = put(9, 1, squares(120));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error().text, HasSubstr("28800 triangles together; you may have 27500"));
  ASSERT_TRUE(put(9, 1, squares(100)));
  // Others do not take away what a participant has.
  EXPECT_EQ(surfaces.roomOf(7), 45'000u);
  ASSERT_TRUE(put(7, 1, squares(150)));
  EXPECT_THAT(taken(), ElementsAre("7:1 45000 at 0", "9:1 20000 at 0"));
}

TEST_F(RoomSurfacesTest, LimitTheNumberOfSurfaces) {
  for (std::uint32_t id = 0; id < model::kMaxSurfacesOfParticipant; ++id) ASSERT_TRUE(put(7, id, squares(1)));
  const auto refused = surfaces.begin(7, 64, {}, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("you have 64 surfaces, and may have 64"));
  ASSERT_TRUE(put(7, 63, squares(2)));                                        // replaces one
  for (std::uint32_t id = 0; id < 32; ++id) static_cast<void>(begin(9, id));  // incomplete ones count
  EXPECT_FALSE(surfaces.begin(9, 32, {}, {}));
}

TEST_F(RoomSurfacesTest, DoNotActWhileTheParticipantIsAway) {
  ASSERT_TRUE(put(7, 1, squares(1)));
  const RoomSurfaces::Ticket onItsWay = begin(7, 2);
  surfaces.withdraw(7);
  EXPECT_THAT(taken(), IsEmpty());
  EXPECT_TRUE(surfaces.put(onItsWay, squares(1), false, 1));
  surfaces.resume(7);
  EXPECT_THAT(taken(), ElementsAre("7:1 2 at 0"));
}

TEST_F(RoomSurfacesTest, NeedTheRoleParticipant) {
  ASSERT_TRUE(put(7, 1, squares(1)));
  surfaces.setRole(7, Role::viewer);
  EXPECT_THAT(taken(), IsEmpty());
  const auto refused = surfaces.begin(7, 1, {}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_FALSE(surfaces.move(7, 1, {}));
  EXPECT_FALSE(surfaces.begin(8, 1, {}, {})) << "of nobody";
}

// A budget with room for this number of triangles.
// What nothing waits for costs the thread that makes surfaces nothing: it does not even find the fault.
TEST(SurfaceMaker, MakesOnlyTheNewestMeshOfASurface) {
  const auto live = std::make_shared<LiveScene>(tests::smallScene());
  live->surfaces.add(7, Role::participant);
  hosting::UploadBudget budget(1'000'000, 1'000'000);
  const auto nan = [&](const RoomSurfaces::Ticket& ticket) {
    hosting::CompleteSurface surface{.parts = {}, .ticket = ticket, .reservation = {budget, ""}};
    surface.parts.vertices.assign(3, model::Vec3::Constant(NAN));
    surface.parts.triangles = {{0, 1, 2}};
    return surface;
  };
  const RoomSurfaces::Ticket former = *live->surfaces.begin(7, 1, {}, {}),
                             newest = *live->surfaces.begin(7, 1, {}, {});
  hosting::SurfaceMaker maker;
  std::vector<std::promise<bool>> accepted(2);
  for (std::size_t i = 0; i < 2; ++i)
    ASSERT_TRUE(maker.make(live, nan(i == 0 ? former : newest),
                           [&accepted, i](const auto& put) { accepted[i].set_value(put.has_value()); }));
  EXPECT_TRUE(accepted[0].get_future().get());
  EXPECT_FALSE(accepted[1].get_future().get());
}

struct SmallBudget : ColliderBudget {
  double roomForHands() const override { return 0; }
  double roomForOthers(double) const override { return 0; }
  void chargeColliders(const ColliderLoad&) override {}
  bool boundsOfCloth(ClothBounds&) const override { return false; }
  messages::Result<void> chargeSurfaces(const SurfaceLoad& load) override {
    if (load.triangles > charged.triangles && load.triangles > room)
      return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED, "surface: too dear"});
    charged = load;
    return {};
  }
  std::size_t room = 0;
  SurfaceLoad charged;
};

TEST(PricedRoomSurfaces, KeepTheFormerSurfaceIfTheBudgetRefusesTheNewOne) {
  SmallBudget budget;
  budget.room = 20;
  RoomSurfaces surfaces(&budget);
  surfaces.add(7, Role::participant);
  const auto put = [&](std::uint32_t cells) {
    return surfaces.put(*surfaces.begin(7, 1, {}, {}), squares(cells), false, 1);
  };
  ASSERT_TRUE(put(3));
  EXPECT_EQ(budget.charged.triangles, 18u);
  EXPECT_GT(budget.charged.searches, 0);
  ASSERT_FALSE(put(4));
  EXPECT_EQ(budget.charged.triangles, 18u);
  std::vector<RoomSurface> all;
  std::uint64_t version = 0;
  surfaces.take(version, all);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].placed.table->surface.triangles.size(), 18u);
  surfaces.remove(7);
  EXPECT_EQ(budget.charged, SurfaceLoad{});
}

// A surface acts when the device has it, and the one that it replaces until then.
class SurfacesInSceneTest : public tests::GpuTest {
 protected:
  static model::Scene fallingScene() {
    model::Scene scene = tests::smallScene();
    scene.colliders.clear();
    scene.cloths[0].pins.clear();
    return scene;
  }
  static messages::Result<void> put(tests::HostedScene& hosted, std::uint32_t id,
                                    simulation::SharedSurface table, float y) {
    RoomSurfaces& surfaces = hosted.live.surfaces;
    return surfaces.put(*surfaces.begin(7, id, at(y), {}), std::move(table), false, 1);
  }
  static float lowest(const tests::HostedScene& hosted) { return hosted.host.status().low.y(); }
};

TEST_F(SurfacesInSceneTest, CarryClothUntilTheyAreRemoved) {
  tests::HostedScene hosted(fallingScene());
  hosted.live.surfaces.add(7, Role::participant);
  ASSERT_TRUE(put(hosted, 1, squares(4), -2));
  hosted.ticks(80);
  EXPECT_GT(lowest(hosted), -2);
  EXPECT_LT(lowest(hosted), -1.9f);
  hosted.live.surfaces.remove(7, 1);
  hosted.ticks(40);
  EXPECT_LT(lowest(hosted), -2.5f);
}

TEST_F(SurfacesInSceneTest, LiftTheClothOnThemWhenTheyMoveUp) {
  tests::HostedScene hosted(fallingScene());
  hosted.live.surfaces.add(7, Role::participant);
  ASSERT_TRUE(put(hosted, 1, squares(4), -2));
  hosted.ticks(80);
  ASSERT_LT(lowest(hosted), -1.9f);
  ASSERT_TRUE(hosted.live.surfaces.move(7, 1, at(-1.98f)));
  hosted.ticks(10);
  EXPECT_GT(lowest(hosted), -1.98f);
}

TEST_F(SurfacesInSceneTest, ActInTheNextTickIfTheyAreSmall) {
  tests::HostedScene hosted(fallingScene());
  hosted.live.surfaces.add(7, Role::participant);
  hosted.tick();
  // Just below the lowest nodes, which fall.
  const float floor = lowest(hosted) - 0.001f;
  ASSERT_TRUE(put(hosted, 1, squares(4), floor));
  hosted.ticks(4);
  EXPECT_GT(lowest(hosted), floor);
}

TEST_F(SurfacesInSceneTest, LargeOnesReplaceTheFormerOneWithoutAGap) {
  tests::HostedScene hosted(fallingScene());
  hosted.live.surfaces.add(7, Role::participant);
  ASSERT_TRUE(put(hosted, 1, squares(4), -2));
  hosted.ticks(80);
  // 50,000 triangles take several ticks. The cloth lies on the old floor meanwhile, and on the new one then.
  ASSERT_TRUE(put(hosted, 1, squares(158), -2));
  for (int tick = 0; tick < 12; ++tick) {
    hosted.tick();
    EXPECT_GT(lowest(hosted), -2) << tick;
  }
  hosted.live.surfaces.remove(7);
  hosted.ticks(40);
  EXPECT_LT(lowest(hosted), -2.5f);
}

TEST_F(SurfacesInSceneTest, ActAgainAtOnceAfterTheDeviceWasLost) {
  tests::HostedScene hosted(fallingScene());
  hosted.live.surfaces.add(7, Role::participant);
  ASSERT_TRUE(put(hosted, 1, squares(4), -2));
  hosted.ticks(80);
  hosted.host.release();
  hosted.host.rebuild(
      std::make_unique<SceneOnDevice>(tests::device(), hosted.live.start(), hosted.publisher.workers()),
      "a test");
  // The scene goes on from its newest snapshot, or falls again from its start.
  hosted.ticks(80);
  EXPECT_GT(lowest(hosted), -2);
  EXPECT_LT(lowest(hosted), -1.9f);
}

}  // namespace
}  // namespace clothstream::scene
