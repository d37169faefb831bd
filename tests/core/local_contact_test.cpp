// SPDX-License-Identifier: MIT
// Local contact through the C interface, and the capsules that it uses.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/touch/own_capsules.h"
#include "tests/core/play_out_viewer.h"

namespace clothstream::client {
namespace {

constexpr float kRadius = 0.1f;

// A waving cloth in the plane z = 0, and a collider of this participant that comes from behind the viewer.
struct Pushed {
  explicit Pushed(bool contact = true) : viewer(chosenDelay(50)) {
    cs_set_local_contact(viewer.client.get(), contact ? 1 : 0);
    viewer.learnClock();
  }
  // The next 10 ms, at the end of which the collider is at this depth behind z = 0.
  void step(float z) {
    ++tick;
    const std::uint64_t now = tick * kFrameUs;
    viewer.receive(tick, now - 5 * kMs, now);
    collider.position[2] = z;
    cs_set_colliders(viewer.client.get(), &collider, 1, now);
    viewer.client.outgoing();
    viewer.play(now);
  }
  // Smallest distance of a shown vertex from the centre of the sphere, or of the upper end of the limb.
  float nearest(float z) const {
    const Floats shown = viewer.playedPositions();
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < shown.size() / 3; ++i)
      least = std::min(least, length(vectorAt(shown.data(), i) - Vector{0.3f, -0.4f, z}));
    return least;
  }
  Viewer viewer;
  cs_own_collider collider = sphereAt(0.3f, -0.4f, 0, kRadius);
  std::uint64_t tick = 0;
};

// A tapered capsule whose upper end is the sphere.
cs_own_collider limb() {
  cs_own_collider limb = sphereAt(0.3f, -0.5f, 0, 0.02f);
  limb.shape = CS_SHAPE_CAPSULE;
  limb.length = 0.2f;
  limb.top_radius = kRadius;
  return limb;
}

TEST(LocalContact, KeepsTheClothOutsideOfTheOwnSphere) {
  Pushed pushed, without(false);
  float z = 0.5f;
  for (; z > -0.05f; z -= 0.01f) {
    pushed.step(z);
    without.step(z);
    // Change of the cloth's correction is limited to 3.5 mm besides the 10 mm of the sphere.
    EXPECT_GE(pushed.nearest(z), kRadius - 0.005f) << z;
  }
  EXPECT_LT(without.nearest(z), 0.08f);
  EXPECT_GT(cs_local_correction(pushed.viewer.client.get()), 0.05f);
  EXPECT_EQ(cs_local_correction(without.viewer.client.get()), 0);
  // Normals belong to the positions that are shown.
  const Floats normals = pushed.viewer.playedNormals();
  for (std::size_t i = 0; i < normals.size() / 3; ++i)
    EXPECT_NEAR(length(vectorAt(normals.data(), i)), 1, 1e-5);
  EXPECT_FALSE(sameBits(normals, without.viewer.playedNormals()));

  // The server never answers. After its time the cloth comes back at 0.35 m/s, and does not stay away.
  float before = cs_local_correction(pushed.viewer.client.get());
  for (int i = 0; i < 60; ++i) {
    pushed.step(z);
    without.step(z);
    const float now = cs_local_correction(pushed.viewer.client.get());
    EXPECT_GE(now, before - 0.0136f) << i;  // 10 mm of the sphere's way and 3.5 mm
    before = now;
  }
  cs_set_local_contact(pushed.viewer.client.get(), 0);
  without.step(z);
  pushed.step(z);
  EXPECT_TRUE(sameBits(pushed.viewer.playedPositions(), without.viewer.playedPositions()));
}

TEST(LocalContact, KeepsTheClothOutsideOfALimb) {
  Pushed pushed;
  pushed.collider = limb();
  for (float z = 0.5f; z > -0.05f; z -= 0.01f) {
    pushed.step(z);
    EXPECT_GE(pushed.nearest(z), kRadius - 0.01f) << z;
  }
}

// A frame whose time is earlier makes play-out forget what it showed, and so the correction too.
TEST(LocalContact, EndsWhenTheServersTimeGoesBack) {
  Pushed pushed;
  for (float z = 0.5f; z > -0.05f; z -= 0.01f) pushed.step(z);
  Viewer& viewer = pushed.viewer;
  ASSERT_GT(cs_local_correction(viewer.client.get()), 0.05f);
  ++pushed.tick;
  viewer.receive(pushed.tick, kFrameUs, pushed.tick * kFrameUs);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
  EXPECT_EQ(cs_played_collider_count(viewer.client.get()), cs_collider_count(viewer.client.get()));
}

TEST(LocalContact, ChangesNothingWithoutACollider) {
  Pushed pushed, without(false);
  for (int i = 0; i < 10; ++i) {
    pushed.step(3);
    without.step(3);
    EXPECT_TRUE(sameBits(pushed.viewer.playedPositions(), without.viewer.playedPositions()));
    EXPECT_TRUE(sameBits(pushed.viewer.playedNormals(), without.viewer.playedNormals()));
  }
  cs_set_colliders(pushed.viewer.client.get(), nullptr, 0, 1'000'000);
  pushed.viewer.play(1'000'000);
  EXPECT_EQ(cs_local_correction(pushed.viewer.client.get()), 0);
}

OwnCapsules twoCapsules(float x) {
  OwnCapsules capsules;
  capsules[1] = {{x, 0, 0}, {x, 0.1f, 0}, 0.01f};
  capsules[60] = {{x, 0, 0}, {x, 0, 0}, 0.02f};
  return capsules;
}

TEST(OwnCapsules, TheHeadIsTheLastAsInFrames) {
  Poses poses;
  poses.head = sphereAt(1, 2, 3, 0.11f);
  poses.rightHand.assign(std::size_t{4} * CS_HAND_JOINTS, 0.01f);
  const OwnCapsules capsules = ownCapsules(poses);
  EXPECT_TRUE(capsules[kOwnCapsules - 2].present());
  EXPECT_EQ(capsules[kOwnCapsules - 1].radius, 0.11f);
  EXPECT_EQ(capsules[kOwnCapsules - 1].from.y, 2);
  EXPECT_FALSE(ownCapsules({}).back().present());
}

TEST(OwnCapsules, HaveTheirTopRadius) {
  Poses poses;
  poses.colliders = {limb(), limb()};
  poses.colliders[1].top_radius = 0;
  const OwnCapsules capsules = ownCapsules(poses);
  EXPECT_EQ(capsules[0].radiusAt(0), 0.02f);
  EXPECT_FLOAT_EQ(capsules[0].radiusAt(1), kRadius);
  EXPECT_EQ(capsules[1].radiusAt(1), 0.02f);
}

TEST(OwnCapsules, AreRecognisedInAFrameByOrderAndSize) {
  std::vector<Collider> frame(4);
  const auto set = [](Collider& collider, std::uint64_t participant, cs_shape shape, float x, float radius) {
    collider.participantId = participant;
    collider.shape = shape;
    collider.position = {x, 0, 0};
    collider.radius = radius;
  };
  set(frame[0], 0, CS_SHAPE_SPHERE, 9, 0.3f);  // of the scene
  set(frame[1], 7, CS_SHAPE_CAPSULE, 5, 0.01f);
  frame[1].position[1] = 0.05f;
  frame[1].length = 0.102f;
  set(frame[2], 7, CS_SHAPE_BOX, 0, 0);
  set(frame[3], 7, CS_SHAPE_SPHERE, 6, 0.02f);
  const std::optional<OwnCapsules> found = capsulesOf(frame, 7, twoCapsules(1));
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found)[1].from.y, -0.001, 1e-6);
  EXPECT_NEAR((*found)[1].to.y, 0.101, 1e-6);
  EXPECT_EQ((*found)[1].to.x, 5);
  EXPECT_EQ((*found)[60].from.x, 6);
  EXPECT_FALSE((*found)[0].present());
  EXPECT_FALSE(capsulesOf(frame, 8, twoCapsules(1)));
  frame[3].radius = 0.03f;
  EXPECT_FALSE(capsulesOf(frame, 7, twoCapsules(1)));
  frame.pop_back();
  EXPECT_FALSE(capsulesOf(frame, 7, twoCapsules(1)));
}

TEST(OwnCapsules, HistoryMovesThemBetweenPosesAndForgetsOldOnes) {
  CapsuleHistory history;
  EXPECT_TRUE(history.empty());
  history.add(twoCapsules(0), 1'000'000);
  history.add(twoCapsules(1), 1'100'000);
  EXPECT_EQ(history.at(0)[1].from.x, 0);
  EXPECT_NEAR(history.at(1'025'000)[1].from.x, 0.25, 1e-6);
  EXPECT_EQ(history.at(1'025'000)[2].present(), false);
  EXPECT_EQ(history.at(2'000'000)[60].from.x, 1);
  history.add(twoCapsules(3), 1'100'000);  // replaces
  EXPECT_EQ(history.newest()[1].from.x, 3);
  for (std::uint64_t time = 1'200'000; time < 9'000'000; time += 100'000) history.add(twoCapsules(4), time);
  EXPECT_EQ(history.at(1'000'000)[1].from.x, 4);
}

}  // namespace
}  // namespace clothstream::client
