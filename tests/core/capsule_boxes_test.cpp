// SPDX-License-Identifier: MIT
// Boxes around capsules: contact leaves out what is far away, and nothing else.
#include "clients/core/touch/capsule_boxes.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/touch/contact.h"

namespace clothstream::client {
namespace {

constexpr std::uint32_t kSide = 24;
constexpr float kEdge = 0.02f;  // m
constexpr std::uint64_t kSecondUs = 1'000'000;

class Random {
 public:
  float within(float least, float most) { return std::uniform_real_distribution(least, most)(engine_); }
  Vector point(float reach) { return {within(-reach, reach), within(-reach, reach), within(-reach, reach)}; }

 private:
  std::mt19937 engine_{5};
};

Box boxOf(const Vector& centre, float reach) {
  Box box;
  box.add(centre, reach);
  return box;
}

// Flat square of kSide x kSide vertices around the origin.
Description sheet() {
  Description description;
  const auto place = [](std::uint32_t index) {
    return kEdge * (static_cast<float>(index) - 0.5f * (kSide - 1));
  };
  for (std::uint32_t row = 0; row < kSide; ++row)
    for (std::uint32_t column = 0; column < kSide; ++column)
      description.restPositions.insert(description.restPositions.end(), {place(column), place(row), 0});
  for (std::uint32_t row = 0; row + 1 < kSide; ++row)
    for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
      const std::uint32_t a = row * kSide + column, b = a + kSide;
      description.triangles.insert(description.triangles.end(), {a, a + 1, b, a + 1, b + 1, b});
    }
  return description;
}

std::vector<float> shown(const OwnCapsules& answered, const OwnCapsules& newest) {
  const Description description = sheet();
  Contact contact;
  contact.begin(description);
  // A second has passed, so that the correction is not limited.
  const std::span<const float> result = contact.apply(description.restPositions, answered, newest, kSecondUs);
  return {result.begin(), result.end()};
}

TEST(CapsuleBoxesTest, FindsTheCapsulesInWhoseBoxesAPointIsInTheirOrder) {
  Random random;
  CapsuleBoxes boxes;
  std::vector<Box> each;
  for (std::size_t i = 0; i < kOwnCapsules; ++i) {
    each.push_back(boxOf(random.point(1), 0.4f));
    boxes.add(i, each.back());
  }
  std::size_t most = 0;
  for (int round = 0; round < 1000; ++round) {
    const Vector point = random.point(1.5f);
    std::vector<std::size_t> expected, found;
    for (std::size_t i = 0; i < each.size(); ++i)
      if (each[i].contains(point)) expected.push_back(i);
    boxes.around(point, [&](std::size_t capsule) { found.push_back(capsule); });
    EXPECT_EQ(found, expected);
    most = std::max(most, found.size());
  }
  EXPECT_GE(most, 5u);
}

TEST(CapsuleBoxesTest, AMovedPointMeetsTheBoxesOfItsNewPlace) {
  CapsuleBoxes boxes;
  boxes.add(4, boxOf({0, 0, 0}, 0.1f));
  boxes.add(6, boxOf({0, 0, 0}, 0.1f));
  boxes.add(7, boxOf({0.5f, 0, 0}, 0.1f));
  Vector point;
  std::vector<std::size_t> found;
  boxes.around(point, [&](std::size_t capsule) {
    found.push_back(capsule);
    point = {0.5f, 0, 0};
  });
  EXPECT_THAT(found, testing::ElementsAre(4, 7));
  boxes.clear();
  EXPECT_TRUE(boxes.empty());
  boxes.around(point, [](std::size_t) { ADD_FAILURE() << "no box remains"; });
}

TEST(CapsuleBoxesTest, ContactKeepsEachVertexOutsideOfACapsule) {
  // No point of a triangle of the sheet is farther from its nearest corner.
  const float reach = std::sqrt(2.0f / 3) * kEdge;
  Random random;
  int touched = 0;
  for (int round = 0; round < 300; ++round) {
    const Vector middle = random.point(0.05f), half = random.point(0.05f);
    OwnCapsules capsules;
    Capsule& capsule = capsules[CS_MAX_COLLIDERS + static_cast<std::size_t>(round) % CS_HAND_BONES];
    capsule = {middle - half, middle + half, random.within(0.005f, 0.1f)};
    const float kept = std::sqrt(capsule.radius * capsule.radius + reach * reach);
    const std::vector<float> positions = shown(capsules, capsules);
    touched += positions == sheet().restPositions ? 0 : 1;
    for (std::size_t vertex = 0; vertex < kSide * kSide; ++vertex) {
      const Vector at = vectorAt(positions.data(), vertex);
      float nearest = 1;
      for (int step = 0; step <= 100; ++step)
        nearest = std::min(nearest, length(at - capsule.at(0.01f * static_cast<float>(step))));
      ASSERT_GE(nearest, kept - 1e-5f) << "vertex " << vertex << " of round " << round;
    }
  }
  EXPECT_GE(touched, 100);
}

TEST(CapsuleBoxesTest, FarCapsulesDoNotChangeContact) {
  const Vector way{0, 0, 0.08f};
  const auto handAt = [](const Vector& place) {
    OwnCapsules capsules;
    for (std::size_t bone = 0; bone < CS_HAND_BONES; ++bone) {
      const Vector from = place + Vector{0.012f * static_cast<float>(bone) - 0.12f, 0, 0};
      capsules[CS_MAX_COLLIDERS + bone] = {from, from + Vector{0, 0.08f, 0}, 0.01f};
    }
    return capsules;
  };
  const OwnCapsules before = handAt({0, 0, -0.03f}), now = handAt(Vector{0, 0, -0.03f} + way);
  const std::vector<float> alone = shown(before, now);
  EXPECT_NE(alone, sheet().restPositions);
  OwnCapsules moreBefore = before, more = now;
  for (std::size_t i = 0; i < kOwnCapsules; ++i) {
    if (more[i].present()) continue;
    const Vector far{3 + 0.1f * static_cast<float>(i), 0, 0};
    moreBefore[i] = {far, far, 0.02f};
    more[i] = {far + way, far + way, 0.02f};
  }
  EXPECT_EQ(shown(moreBefore, more), alone);
}

}  // namespace
}  // namespace clothstream::client
