// SPDX-License-Identifier: MIT
// Colliders in frames whose memory is reused.
#include "server/scene/collider_set.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

TEST(ColliderSet, WritesTheSameIntoUsedFrames) {
  model::Scene scene = tests::smallScene();
  scene.colliders.emplace_back().name = "post";
  scene.colliders.back().shape = model::Capsule{.radius = 0.1f, .length = 1, .topRadius = 0.05f};
  ColliderSet set(scene);
  std::vector<simulation::MovingCollider> moving;
  v1::Frame used;
  double seconds = 0;
  const auto place = [&](const std::vector<model::Shape>& shapes) {
    std::vector<model::ParticipantCollider> colliders;
    for (const model::Shape& shape : shapes) {
      colliders.push_back(tests::handAt(static_cast<std::uint32_t>(colliders.size()), 0.1f));
      colliders.back().shape = shape;
    }
    set.place(7, colliders);
    set.advance(scene, seconds += scene.tickSeconds(), moving);
    v1::Frame fresh;
    set.write(scene, fresh);
    set.write(scene, used);
    EXPECT_EQ(used.colliders_size(), static_cast<int>(2 + shapes.size()));
    EXPECT_EQ(used.SerializeAsString(), fresh.SerializeAsString());
  };
  const model::Capsule tapered{.radius = 0.1f, .length = 0.2f, .topRadius = 0.05f}, even{.radius = 0.1f};
  place({tapered, model::Sphere{0.1f}, model::Box{model::Vec3(0.1f, 0.2f, 0.3f)}});
  place({even, model::Box{model::Vec3(0.3f, 0.2f, 0.1f)}});
  place({model::Sphere{0.2f}, tapered, tapered, even});
  place({});
  place({even});
}

}  // namespace
}  // namespace clothstream::scene
