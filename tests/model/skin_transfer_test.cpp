// SPDX-License-Identifier: MIT
// Joints that points take from the nearest point of a mesh.
#include "server/model/skin_transfer.h"

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model/solids.h"

namespace clothstream::model {
namespace {

using testing::ElementsAre;

// `weights(vertex)` are those of the joints 0, 1 and 2.
ClosedMesh skinnedMesh(const Solid& solid, const auto& weights) {
  ClosedMesh mesh = *solid;
  Skin& skin = mesh.skin.emplace();
  skin.joints.resize(3);
  for (const Vec3& vertex : mesh.vertices) {
    const std::array<float, 3> own = weights(vertex);
    skin.vertices.push_back({.joints = {0, 1, 2, 0}, .weights = {own[0], own[1], own[2], 0}});
  }
  return mesh;
}

std::array<double, 3> byJoint(const VertexJoints& joints) {
  std::array<double, 3> weights{};
  for (std::size_t k = 0; k < kVertexJoints; ++k) weights[joints.joints[k]] += double{joints.weights[k]};
  return weights;
}

TEST(SkinTransfer, KeepsTheFourLargestWeights) {
  const VertexJoints joints = largestJoints({{5, 0.1}, {2, 0.3}, {9, 0.05}, {1, 0.1}, {7, 0.2}, {8, 1e-8}});
  EXPECT_THAT(joints.joints, ElementsAre(2, 7, 1, 5));
  for (const auto& [k, weight] : {std::pair(0u, 0.3), {1u, 0.2}, {2u, 0.1}, {3u, 0.1}})
    EXPECT_NEAR(joints.weights[k], weight / 0.7, 1e-7);
  EXPECT_THAT(largestJoints({{3, 0.5}, {4, 1e-8}}).weights, ElementsAre(1, 0, 0, 0))
      << "tiny weights are left out";
}

// A cylinder of two joints along X with 16 sides. On its flat sides the nearest point has the x of the point,
// and weights that are linear in x are so between vertices as well.
TEST(SkinTransfer, BlendsTheWeightsOfAFaceByThePlaceOfTheNearestPoint) {
  const auto share = [](float x) { return x + 0.5f; };
  const ClosedMesh mesh = skinnedMesh(rodMesh(0.1f, 1, 16, 10), [&](const Vec3& vertex) {
    return std::array{1 - share(vertex.x()), share(vertex.x()), 0.0f};
  });
  std::mt19937 random(7);
  std::uniform_real_distribution<float> along(-0.5f, 0.5f), across(-1, 1);
  std::vector<Vec3> points;
  while (points.size() < 500) {
    const Vec3 point(along(random), across(random), across(random));
    if (point.tail<2>().norm() > 0.11f) points.push_back(point);
  }
  const std::vector<VertexJoints> joints = jointsNear(mesh, points);
  ASSERT_EQ(joints.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Floats near 1, of which a few are added.
    EXPECT_NEAR(byJoint(joints[i])[1], double{share(points[i].x())}, 1e-6) << points[i].transpose();
    EXPECT_NEAR(byJoint(joints[i])[0], 1 - double{share(points[i].x())}, 1e-6);
  }
}

// Points of the surface itself: the mean of the vertices' weights by the shares that made the point.
TEST(SkinTransfer, FindsTheFaceOfEveryPointOfTheSurface) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> any(0.05f, 1);
  const ClosedMesh mesh = skinnedMesh(torus(0.5f, 0.2f, 60, 30), [&](const Vec3&) {
    const std::array weights{any(random), any(random), any(random)};
    const float sum = weights[0] + weights[1] + weights[2];
    return std::array{weights[0] / sum, weights[1] / sum, weights[2] / sum};
  });
  std::vector<Vec3> points;
  std::vector<std::array<double, 3>> expected;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    const std::array shares{0.2, 0.3, 0.5};
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    std::array<double, 3> weights{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = mesh.triangles[t][corner];
      point += shares[corner] * mesh.vertices[vertex].cast<double>();
      for (std::size_t k = 0; k < 3; ++k)
        weights[k] += shares[corner] * byJoint(mesh.skin->vertices[vertex])[k];
    }
    points.push_back(point.cast<float>());
    expected.push_back(weights);
  }
  const std::vector<VertexJoints> joints = jointsNear(mesh, points);
  // A point is rounded by 6e-8 m. Weights change by at most 1 across an edge, and the shortest is 3 cm.
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(byJoint(joints[i])[k], expected[i][k], 1e-5) << i;
}

// A box whose left side has one joint, and whose right side has another.
TEST(SkinTransfer, FindsTheNearestFaceFromFarAndFromInside) {
  const ClosedMesh mesh = skinnedMesh(boxMesh({1, 2, 3}), [](const Vec3& vertex) {
    return vertex.x() < 0 ? std::array{1.0f, 0.0f, 0.0f} : std::array{0.0f, 1.0f, 0.0f};
  });
  const std::vector<Vec3> points{
      {-0.45f, 0, 0}, {0.45f, 0.2f, 1}, {-9, 3, 2}, {700, -500, 3}, {-0.25f, 1.01f, 0}};
  const std::vector<VertexJoints> joints = jointsNear(mesh, points);
  EXPECT_THAT(byJoint(joints[0]), ElementsAre(1, 0, 0));
  EXPECT_THAT(byJoint(joints[1]), ElementsAre(0, 1, 0));
  EXPECT_THAT(byJoint(joints[2]), ElementsAre(1, 0, 0));
  EXPECT_THAT(byJoint(joints[3]), ElementsAre(0, 1, 0));
  EXPECT_NEAR(byJoint(joints[4])[0], 0.75, 1e-6) << "on the upper side, a quarter of the way from the left";
}

TEST(SkinTransfer, DoesNotDependOnTheOtherPoints) {
  const ClosedMesh mesh = skinnedMesh(torus(0.5f, 0.2f, 30, 20), [](const Vec3& vertex) {
    return std::array{0.5f + vertex.x() / 2, 0.5f - vertex.x() / 2, 0.0f};
  });
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<Vec3> points;
  for (int i = 0; i < 300; ++i) points.emplace_back(any(random), any(random), any(random));
  const std::vector<VertexJoints> together = jointsNear(mesh, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const VertexJoints alone = jointsNear(mesh, std::span(points).subspan(i, 1))[0];
    EXPECT_EQ(alone.joints, together[i].joints);
    EXPECT_EQ(alone.weights, together[i].weights);
  }
}

TEST(SkinTransfer, EndsEarlyIfCancelled) {
  const ClosedMesh mesh = skinnedMesh(boxMesh({1, 1, 1}), [](const Vec3&) {
    return std::array{1.0f, 0.0f, 0.0f};
  });
  const std::vector<Vec3> points(10'000, Vec3(1, 2, 3));
  int calls = 0;
  EXPECT_THROW(jointsNear(mesh, points, Cancellation([&] { return ++calls == 2; })), Cancelled);
}

}  // namespace
}  // namespace clothstream::model
