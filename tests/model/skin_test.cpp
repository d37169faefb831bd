// SPDX-License-Identifier: MIT
// Poses of joints, and the vertices that they move.
#include "server/model/skin.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

namespace {
std::uint64_t allocations = 0;
}

// Counts the allocations of this program. Inlined, the compiler would see a mismatch of new and free. The
// form that does not throw is replaced as well: a sanitizer would otherwise allocate with its own, and
// complain when free gets it.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* memory = ::operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace clothstream::model {
namespace {

Quaternion turned(float degrees, const Vec3& axis) {
  return Quaternion(Eigen::AngleAxisf(degrees * std::acos(-1.0f) / 180, axis.normalized()));
}

// A chain of as many joints as are allowed, each a little above the one before.
Skin chain() {
  Skin skin;
  for (std::uint32_t i = 0; i < kMaxJoints; ++i) {
    skin.joints.push_back({"joint", std::nullopt, {Vec3(0, 0.01f, 0.002f), turned(3, Vec3(1, 0.5f, 0))}});
    if (i > 0) skin.joints.back().parent = i - 1;
  }
  return skin;
}

Eigen::Isometry3d isometryOf(const Pose& pose) {
  return Eigen::Translation3d(pose.position.cast<double>()) * pose.orientation.cast<double>().normalized();
}

TEST(Skin, JointsMovePointsLikeTheProductOfTheirTransforms) {
  const Skin skin = chain();
  std::vector<Pose> local = restJoints(skin), poses;
  for (Pose& pose : local) pose.orientation = turned(5, Vec3(0.2f, 1, 0.3f));
  compose(skin, local, poses);
  const std::vector<Transform> transforms = jointTransforms(skin, poses);
  Eigen::Isometry3d now = Eigen::Isometry3d::Identity(), rest = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d point(0.3, -0.1, 0.2);
  for (std::size_t i = 0; i < local.size(); ++i) {
    now = now * isometryOf(local[i]);
    rest = rest * isometryOf(skin.joints[i].rest);
    const Eigen::Vector3d expected = now * (rest.inverse() * point);
    // Poses of joints are rounded to floats.
    EXPECT_LT((transformed(transforms[i], point) - expected).norm(), 3e-7) << "joint " << i;
  }
}

TEST(Skin, ATickAllocatesNothing) {
  const Skin skin = chain();
  const std::vector<Pose> local = restJoints(skin);
  std::vector<Pose> poses;
  compose(skin, local, poses);
  const std::vector<JointFrame> rests = inverseRests(skin);
  std::vector<Transform> transforms(skin.joints.size());
  const std::uint64_t before = allocations;
  compose(skin, local, poses);
  jointTransforms(rests, poses, transforms);
  EXPECT_EQ(allocations, before);
  EXPECT_GT(before, 0u);
}

}  // namespace
}  // namespace clothstream::model
