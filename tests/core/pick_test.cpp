// SPDX-License-Identifier: MIT
// Points of the shown cloths, and grabs that name them.
#include <cmath>
#include <cstdint>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/touch/vector.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

// Two waving cloths, of which one frame is shown.
struct Shown {
  Shown() {
    ScriptedStream stream;
    stream.cloths = {{"curtain", 9, 7}, {"flag", 6, 8}};
    ScriptedServer server(stream);
    client.join(server);
    client.receive(server.frame(31, codec::PacketKind::key));
    triangles = cs_triangles(client.get(), &corners);
  }
  Vector corner(std::uint32_t triangle, std::uint32_t which) const {
    return vectorAt(cs_positions(client.get()), triangles[3 * triangle + which]);
  }
  Vector at(std::uint32_t triangle, float second, float third) const {
    const Vector a = corner(triangle, 0);
    return a + second * (corner(triangle, 1) - a) + third * (corner(triangle, 2) - a);
  }
  ClientUnderTest client;
  const std::uint32_t* triangles = nullptr;
  std::uint32_t corners = 0;
};

Vector positionOf(const cs_cloth_point& point) {
  return vectorAt(point.position, 0);
}

// Compares with all points of a lattice of 21 x 21 on each triangle. No point of the triangle is farther from
// its nearest lattice point than a twentieth of the longest edge.
TEST(Pick, NearestPointIsNoFartherThanAnyOther) {
  const Shown shown;
  for (int i = 0; i < 40; ++i) {
    const auto t = static_cast<float>(i);
    const Vector from{std::sin(1.3f * t), 1 + std::sin(2.1f * t), 0.5f * std::sin(3.7f * t)};
    float nearest = std::numeric_limits<float>::infinity(), edge = 0;
    for (std::uint32_t triangle = 0; triangle < shown.corners / 3; ++triangle) {
      edge = std::max(edge, length(shown.corner(triangle, 1) - shown.corner(triangle, 2)));
      for (int b = 0; b <= 20; ++b)
        for (int c = 0; b + c <= 20; ++c)
          nearest = std::min(
              nearest,
              length(shown.at(triangle, static_cast<float>(b) / 20, static_cast<float>(c) / 20) - from));
    }
    cs_cloth_point point;
    ASSERT_EQ(cs_nearest_point(shown.client.get(), &from.x, 10, &point), 1);
    EXPECT_LE(point.distance, nearest * (1 + 1e-6f));
    EXPECT_GE(point.distance, nearest - edge / 20);
    EXPECT_NEAR(length(positionOf(point) - from), point.distance, 1e-6);
    EXPECT_LT(length(shown.at(point.triangle, point.second, point.third) - positionOf(point)), 1e-6f);
    EXPECT_EQ(point.tick, 31u);
    EXPECT_EQ(cs_nearest_point(shown.client.get(), &from.x, 0.99f * point.distance, &point), 0);
  }
}

TEST(Pick, RaysMeetTheFirstTriangleAtWhichTheyAim) {
  const Shown shown;
  for (std::uint32_t triangle = 0; triangle < shown.corners / 3; ++triangle) {
    const Vector target = shown.at(triangle, 0.3f, 0.45f);
    // The cloths hang side by side and do not hide each other from the front.
    const Vector origin = target + Vector{0, 0, 2}, direction{0, 0, -3};
    cs_cloth_point point;
    ASSERT_EQ(cs_cast_ray(shown.client.get(), &origin.x, &direction.x, 5, &point), 1);
    EXPECT_LT(length(positionOf(point) - target), 1e-5f);
    EXPECT_NEAR(point.distance, 2, 1e-5);
    EXPECT_EQ(point.triangle, triangle);
    EXPECT_EQ(cs_cast_ray(shown.client.get(), &origin.x, &direction.x, 1.9f, &point), 0);
    const Vector back{0, 0, 1};
    EXPECT_EQ(cs_cast_ray(shown.client.get(), &origin.x, &back.x, 5, &point), 0);
  }
}

TEST(Pick, RefusesNumbersThatAreNotFiniteAndLeavesTheResult) {
  const Shown shown;
  cs_cloth_point point{};
  point.triangle = 77;
  const float nan[] = {0, kNotANumber, 0}, good[] = {0, 1, 0}, none[] = {0, 0, 0};
  EXPECT_EQ(cs_nearest_point(shown.client.get(), nan, 10, &point), 0);
  EXPECT_EQ(cs_nearest_point(shown.client.get(), good, kNotANumber, &point), 0);
  EXPECT_EQ(cs_nearest_point(shown.client.get(), good, -1, &point), 0);
  EXPECT_EQ(cs_cast_ray(shown.client.get(), nan, good, 10, &point), 0);
  EXPECT_EQ(cs_cast_ray(shown.client.get(), good, nan, 10, &point), 0);
  EXPECT_EQ(cs_cast_ray(shown.client.get(), good, none, 10, &point), 0);
  point.version = CS_CLOTH_POINT_VERSION + 1;
  EXPECT_EQ(cs_nearest_point(shown.client.get(), good, 10, &point), 0);
  EXPECT_EQ(point.triangle, 77u);
  const ClientUnderTest joining;
  EXPECT_EQ(cs_nearest_point(joining.get(), good, 10, &point), 0);
}

TEST(Grabs, NameThePlaceThatWasSeen) {
  const Shown shown;
  ClientUnderTest& client = const_cast<Shown&>(shown).client;
  client.outgoing();
  cs_grab grab{};
  grab.id = 3;
  cs_cloth_point point;
  grab.place = &point;
  cs_cloth flag;
  ASSERT_EQ(cs_get_cloth(client.get(), 1, &flag), 1);
  const Vector target = shown.at(flag.first_index / 3 + 20, 0.25f, 0.5f);
  ASSERT_EQ(cs_nearest_point(client.get(), &target.x, 1, &point), 1);
  const auto sent = [&] {
    cs_set_grabs(client.get(), &grab, 1, 5);
    return client.outgoing().at(0).collider_poses().grabs(0);
  };
  const v1::GrabPlace place = sent().place();
  EXPECT_EQ(place.cloth(), 1u);
  EXPECT_EQ(place.triangle(), 20u);
  EXPECT_NEAR(place.second(), 0.25, 1e-4);
  EXPECT_NEAR(place.third(), 0.5, 1e-4);
  EXPECT_EQ(place.seen_tick(), 31u);
  point.triangle = shown.corners / 3;  // not a triangle of the scene
  EXPECT_FALSE(sent().has_place());
}

}  // namespace
}  // namespace clothstream::client
