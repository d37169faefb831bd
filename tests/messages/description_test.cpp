// SPDX-License-Identifier: MIT
// Descriptions, collider states and chunks.
#include "server/messages/description.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string_view>

#include <gtest/gtest.h>

#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/model/mesh.h"
#include "tests/messages/scenes.h"
#include "tests/model/meshes.h"

namespace clothstream::messages {
namespace {

TEST(ToDescription, HasEverythingThatADecoderNeeds) {
  const model::Scene scene = *toScene(smallScene());
  const v1::StreamDescription description = toDescription(scene, 3, 1, 0);
  EXPECT_EQ(description.epoch(), 3u);
  EXPECT_EQ(description.codec(), 1u);
  EXPECT_EQ(description.scene(), "small");
  EXPECT_EQ(description.simulation_rate(), 72u);
  EXPECT_EQ(description.stream_rate(), 72u);
  EXPECT_EQ(description.max_error(), 0.0005f);
  EXPECT_EQ(description.normals(), v1::NORMALS_NONE);
  ASSERT_EQ(description.cloths_size(), 1);
  const v1::ClothDescription& cloth = description.cloths(0);
  EXPECT_EQ(cloth.name(), "sheet");
  EXPECT_EQ(cloth.vertex_count(), 20u);
  EXPECT_EQ(cloth.rows(), 4u);
  EXPECT_EQ(cloth.columns(), 5u);
  ASSERT_EQ(cloth.rest_positions().size(), 20u * 12);
  const std::vector<model::Vec3> rest = model::restPositions(scene.cloths[0].grid);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    float position[3];
    std::memcpy(position, cloth.rest_positions().data() + i * 12, 12);
    EXPECT_EQ(model::Vec3(position[0], position[1], position[2]), rest[i]);
  }
  EXPECT_TRUE(toScene(description.definition()));
}

TEST(ToDescription, HasTheOriginOfAFarScene) {
  v1::Scene message = smallScene();
  EXPECT_FALSE(toDescription(*toScene(message), 3, 1, 0).has_origin());
  message.mutable_cloths(0)->mutable_grid()->mutable_pose()->mutable_position()->set_x(-700);
  const v1::Vec3 origin = toDescription(*toScene(message), 3, 1, 0).origin();
  EXPECT_EQ(model::Vec3(origin.x(), origin.y(), origin.z()), model::Vec3(-704, 0, 0));
}

TEST(ToDescription, HasThePressureOfClothsThatCanHoldGas) {
  model::Scene scene = *toScene(smallScene());
  scene.cloths.push_back(scene.cloths[0]);
  scene.cloths[1].mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::cube(1)));
  const auto cloths = [&] { return toDescription(scene, 3, 1, 0).definition().cloths(); };
  EXPECT_FALSE(cloths()[0].has_pressure());
  EXPECT_TRUE(cloths()[1].has_pressure());
  scene.integrator = model::Integrator::rungeKutta4;
  EXPECT_FALSE(cloths()[1].has_pressure());
}

TEST(ToDescription, EqualsItsTwoPartsConcatenated) {
  const model::Scene scene = *toScene(sceneWithHull());
  v1::StreamDescription parsed;
  ASSERT_TRUE(parsed.ParseFromString(clothsOfDescription(scene).SerializeAsString() +
                                     descriptionWithoutCloths(scene, 3, 2, 0.5).SerializeAsString()));
  EXPECT_EQ(parsed.SerializeAsString(), toDescription(scene, 3, 2, 0.5).SerializeAsString());
  EXPECT_EQ(parsed.cloths_size(), 1);
}

TEST(ToSummary, CountsVerticesAndCloths) {
  const v1::SceneSummary summary = toSummary(*toScene(smallScene()));
  EXPECT_EQ(summary.name(), "small");
  EXPECT_EQ(summary.vertex_count(), 20u);
  EXPECT_EQ(summary.cloth_count(), 1u);
}

TEST(ColliderStates, OverwriteThePreviousState) {
  v1::ColliderState state;
  write(model::ParticipantCollider{.id = 4, .pose = {model::Vec3(1, 2, 3)}, .shape = model::Sphere{0.5f}}, 77,
        state);
  EXPECT_EQ(state.name(), "4");
  EXPECT_EQ(state.participant_id(), 77u);
  EXPECT_EQ(state.position().z(), 3);
  EXPECT_EQ(state.orientation().w(), 1);
  EXPECT_EQ(state.sphere().radius(), 0.5f);
  const model::Scene scene = *toScene(smallScene());
  write(scene.colliders[0], model::Pose{model::Vec3(9, 0, 0)}, state);
  EXPECT_EQ(state.name(), "ball");
  EXPECT_EQ(state.participant_id(), 0u);
  EXPECT_EQ(state.position().x(), 9);
  EXPECT_EQ(state.position().z(), 0);
  EXPECT_EQ(state.sphere().radius(), 0.25f);
}

TEST(ColliderStates, HaveTheShapeExceptForHulls) {
  v1::ColliderState state;
  const model::Pose pose{model::Vec3(1, 2, 3), model::Quaternion(0, 0, 1, 0)};
  write(model::Collider{.name = "a", .shape = model::Capsule{.radius = 0.1f, .length = 0.4f}}, pose, state);
  EXPECT_EQ(state.capsule().length(), 0.4f);
  EXPECT_FALSE(state.capsule().has_top_radius());
  EXPECT_EQ(state.orientation().y(), 1);
  write(model::Collider{.name = "limb", .shape = model::Capsule{.topRadius = 0.2f}}, pose, state);
  EXPECT_EQ(state.capsule().top_radius(), 0.2f);
  write(model::Collider{.name = "b", .shape = model::Plane{}}, pose, state);
  EXPECT_TRUE(state.has_plane());
  write(model::Collider{.name = "c", .shape = model::Box{model::Vec3(1, 2, 3)}}, pose, state);
  EXPECT_EQ(state.box().size().z(), 3);
  const model::Scene scene = *toScene(sceneWithHull());
  write(scene.colliders[0], pose, state);
  EXPECT_EQ(state.shape_case(), v1::ColliderState::SHAPE_NOT_SET);
}

TEST(ToDescription, HasCollidersAndHullsAtTheGivenTime) {
  v1::Scene message = sceneWithHull();
  v1::Motion& motion = *message.mutable_colliders(0)->mutable_motion();
  motion.set_steady(true);
  motion.add_keys();
  motion.add_keys()->set_time(2);
  motion.mutable_keys(1)->mutable_position()->set_x(4);
  const v1::StreamDescription description = toDescription(*toScene(message), 1, 1, 0.5);
  ASSERT_EQ(description.colliders_size(), 1);
  EXPECT_EQ(description.colliders(0).position().x(), 1);
  EXPECT_EQ(description.colliders(0).hull().vertices_size(), 4);
  EXPECT_EQ(description.colliders(0).hull().faces(2).vertices_size(), 3);
}

TEST(ToChunk, SplitsContentThatCanBeReassembled) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, limits::kMaxChunkBytes,
                                 limits::kMaxChunkBytes + 1, 3 * limits::kMaxChunkBytes - 5}) {
    std::string content(size, '\0');
    for (std::size_t i = 0; i < size; ++i) content[i] = static_cast<char>(i * 31 >> 3);
    for (const std::size_t cut : {std::size_t{0}, size / 3, size}) {
      const std::string_view whole = content;
      const std::array parts{whole.substr(0, cut), whole.substr(cut)};
      const std::size_t count = chunkCount(size);
      EXPECT_EQ(count,
                std::max<std::size_t>(1, (size + limits::kMaxChunkBytes - 1) / limits::kMaxChunkBytes));
      std::string together;
      for (std::size_t i = 0; i < count; ++i) {
        const v1::Chunk chunk = toChunk(9, v1::CONTENT_KIND_STREAM_DESCRIPTION, parts, i);
        EXPECT_EQ(chunk.content_id(), 9u);
        EXPECT_EQ(chunk.kind(), v1::CONTENT_KIND_STREAM_DESCRIPTION);
        EXPECT_EQ(chunk.index(), i);
        EXPECT_EQ(chunk.count(), count);
        EXPECT_EQ(chunk.total_bytes(), size);
        EXPECT_LE(chunk.data().size(), limits::kMaxChunkBytes);
        together += chunk.data();
      }
      EXPECT_EQ(together, content);
    }
  }
}

}  // namespace
}  // namespace clothstream::messages
