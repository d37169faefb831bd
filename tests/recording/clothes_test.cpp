// SPDX-License-Identifier: MIT
// Ticks of scenes with cloths that follow joints.
#include <cstdint>

#include <gtest/gtest.h>

#include "server/messages/scene_message.h"
#include "server/model/cloth_skin.h"
#include "server/recording/tick_message.h"

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
  v1::Collider& body = *scene.add_colliders();
  body.set_name("body");
  for (const float number : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f})
    body.mutable_mesh()->add_positions(number);
  for (const std::uint32_t corner : {0u, 2u, 1u, 0u, 1u, 3u, 0u, 3u, 2u, 1u, 2u, 3u})
    body.mutable_mesh()->add_triangles(corner);
  v1::Skin& joints = *body.mutable_mesh()->mutable_skin();
  joints.add_joints()->set_name("root");
  for (int i = 0; i < 16; ++i) {
    joints.add_vertex_joints(0);
    joints.add_vertex_weights(i % 4 == 0 ? 1 : 0);
  }
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
