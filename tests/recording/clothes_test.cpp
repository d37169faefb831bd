// SPDX-License-Identifier: MIT
// Ticks of scenes with cloths that follow joints.
#include <gtest/gtest.h>

#include "server/messages/scene_message.h"
#include "server/model/cloth_skin.h"
#include "server/recording/tick_message.h"
#include "tests/messages/scenes.h"

namespace clothstream::recording {
namespace {

v1::Scene sheetOnATetrahedron() {
  v1::Scene scene;
  scene.set_name("clothes");
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_grid()->set_rows(2);
  cloth.mutable_grid()->set_columns(2);
  cloth.mutable_grid()->set_width(1);
  cloth.mutable_grid()->set_height(1);
  cloth.mutable_skin()->set_collider("body");
  cloth.mutable_skin()->mutable_limits()->set_max_distance(0.5f);
  *scene.add_colliders() = messages::jointedTetrahedron("body", 1);
  return scene;
}

// The definition of the recording has joints and limits once, and a change of parameters keeps them.
TEST(RecordedClothes, KeepTheirJointsWhenParametersChange) {
  const messages::Result<model::Scene> scene = messages::toScene(sheetOnATetrahedron());
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene definition = messages::toMessage(*scene);
  v1::RecordedTick tick;
  v1::Cloth& changed = *tick.add_cloths()->mutable_cloth();
  changed = messages::toMessageWithoutMeshes(*scene).cloths(0);
  changed.clear_grid();
  changed.clear_skin();
  changed.set_thickness(0.25f);
  const auto cloths = toCloths(tick, definition);
  ASSERT_TRUE(cloths) << cloths.error();
  EXPECT_EQ(cloths->at(0).thickness, 0.25f);
  ASSERT_TRUE(cloths->at(0).skin);
  EXPECT_EQ(cloths->at(0).skin->limits, scene->cloths[0].skin->limits);
}

}  // namespace
}  // namespace clothstream::recording
