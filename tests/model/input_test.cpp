// SPDX-License-Identifier: MIT
// Parameter changes affect only what they name.
#include "server/model/input.h"

#include <gtest/gtest.h>

namespace clothstream::model {
namespace {

using parameters::ClothNumber;

Scene twoClothsAndABall() {
  Scene scene;
  scene.cloths.resize(2);
  scene.cloths[0].name = "left";
  scene.cloths[1].name = "right";
  scene.colliders.resize(1);
  scene.colliders[0].name = "ball";
  scene.colliders[0].motion.keys = {{0, Vec3(0, 0, 0)}, {1, Vec3(1, 0, 0)}};
  return scene;
}

TEST(ApplyChange, ChangesNothingWhenEmpty) {
  Scene scene = twoClothsAndABall();
  applyChange(scene, {});
  EXPECT_EQ(scene.environment.gravity, Vec3(0, -9.81f, 0));
  EXPECT_EQ(scene.cloths[0].friction, 0.3f);
  EXPECT_EQ(scene.colliders[0].motion.keys.size(), 2u);
}

TEST(ApplyChange, SetsTheEnvironment) {
  Scene scene = twoClothsAndABall();
  ParameterChange change;
  change.environment[parameters::kGravity] = {0, -1.62f, 0};
  change.environment[parameters::kWind] = {3, 0, 0};
  change.environment[parameters::kAirDensity] = {0.02f};
  applyChange(scene, change);
  EXPECT_EQ(scene.environment.gravity, Vec3(0, -1.62f, 0));
  EXPECT_EQ(scene.environment.wind, Vec3(3, 0, 0));
  EXPECT_EQ(scene.environment.airDensity, 0.02f);
}

TEST(ApplyChange, SetsEveryClothParameterOfTheNamedCloth) {
  Scene scene = twoClothsAndABall();
  ClothChange change{.name = "right",
                     .numbers = {{ClothNumber::structuralStiffness, 1.f},
                                 {ClothNumber::structuralDamping, 2.f},
                                 {ClothNumber::shearStiffness, 3.f},
                                 {ClothNumber::shearDamping, 4.f},
                                 {ClothNumber::bendStiffness, 5.f},
                                 {ClothNumber::bendDamping, 6.f},
                                 {ClothNumber::damping, 7.f},
                                 {ClothNumber::drag, 8.f},
                                 {ClothNumber::lift, 9.f},
                                 {ClothNumber::friction, 0.5f}}};
  applyChange(scene, {.cloths = {change}});
  const Cloth& right = scene.cloths[1];
  EXPECT_EQ(right.structural.stiffness, 1);
  EXPECT_EQ(right.structural.damping, 2);
  EXPECT_EQ(right.shear.stiffness, 3);
  EXPECT_EQ(right.shear.damping, 4);
  EXPECT_EQ(right.bend.stiffness, 5);
  EXPECT_EQ(right.bend.damping, 6);
  EXPECT_EQ(right.damping, 7);
  EXPECT_EQ(right.drag, 8);
  EXPECT_EQ(right.lift, 9);
  EXPECT_EQ(right.friction, 0.5f);
  EXPECT_EQ(scene.cloths[0].structural.stiffness, 0);
  EXPECT_EQ(scene.cloths[0].friction, 0.3f);
}

TEST(ApplyChange, SetsEveryClothIfTheNameIsEmpty) {
  Scene scene = twoClothsAndABall();
  applyChange(scene, {.cloths = {{.numbers = {{ClothNumber::drag, 1.f}}}}});
  EXPECT_EQ(scene.cloths[0].drag, 1);
  EXPECT_EQ(scene.cloths[1].drag, 1);
}

TEST(ApplyChange, EndsTheMotionWithAPositionButNotWithARadius) {
  Scene scene = twoClothsAndABall();
  applyChange(scene, {.colliders = {{.name = "ball", .radius = 0.7f}}});
  EXPECT_EQ(std::get<Sphere>(scene.colliders[0].shape).radius, 0.7f);
  EXPECT_EQ(scene.colliders[0].motion.keys.size(), 2u);
  applyChange(scene, {.colliders = {{.name = "ball", .position = Vec3(1, 2, 3)}}});
  EXPECT_EQ(poseAt(scene.colliders[0], 0.5).position, Vec3(1, 2, 3));
}

TEST(ApplyChange, RotatesAColliderInPlace) {
  Scene scene = twoClothsAndABall();
  scene.colliders[0].pose.position = Vec3(1, 2, 3);
  const Quaternion onItsSide(0, 1, 0, 0);
  applyChange(scene, {.colliders = {{.name = "ball", .orientation = onItsSide}}});
  EXPECT_EQ(poseAt(scene.colliders[0], 0.5).position, Vec3(1, 2, 3));
  EXPECT_EQ(poseAt(scene.colliders[0], 0.5).orientation.coeffs(), onItsSide.coeffs());
}

}  // namespace
}  // namespace clothstream::model
