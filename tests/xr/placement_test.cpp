// SPDX-License-Identifier: MIT
#include "clients/xr/input/placement.h"

#include <gtest/gtest.h>

#include "clients/xr/input/panel_seat.h"
#include "tests/xr/hand_samples.h"

namespace clothstream::xr {
namespace {

Pose headAt(const Eigen::Vector3f& position, float yaw) {
  return {position, Eigen::Quaternionf(Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY()))};
}

TEST(XrPlacement, PutsFrontOfSceneAnArmAheadOnTheFloor) {
  const SceneBounds bounds{{-1, 0.2f, -1}, {1, 2, 0.4f}};
  Placement placement;
  // The user looks along -X.
  placement.placeBefore(headAt({3, 1.7f, 1}, kPi / 2), bounds);
  const Eigen::Vector3f front = placement.toRoom().apply({0, 0.2f, 0.4f});
  EXPECT_TRUE(front.isApprox(Eigen::Vector3f(3 - Placement::kArmLength, 0, 1), 1e-4f)) << front.transpose();
  // The back of the scene is farther away.
  EXPECT_LT(placement.toRoom().apply({0, 0.2f, -1}).x(), front.x());
  EXPECT_TRUE(placement.toScene().apply(front).isApprox(Eigen::Vector3f(0, 0.2f, 0.4f), 1e-4f));
}

TEST(XrPlacement, LookingStraightDownPlacesTheSceneAhead) {
  Placement placement;
  const Pose head{{0, 1.7f, 0}, Eigen::Quaternionf(Eigen::AngleAxisf(-kPi / 2, Eigen::Vector3f::UnitX()))};
  placement.placeBefore(head, SceneBounds{});
  EXPECT_TRUE(placement.toRoom().position.allFinite());
  EXPECT_TRUE(placement.toRoom().orientation.isApprox(Eigen::Quaternionf::Identity(), 1e-4f));
}

TEST(XrPanelSeat, FacesTheEyesOfTheUserToTheLeft) {
  PanelSeat seat;
  seat.seat(headAt({2, 1.6f, 0}, 0));
  const Eigen::Vector3f normal = seat.pose().orientation * Eigen::Vector3f::UnitZ();
  const Eigen::Vector3f toEyes = (Eigen::Vector3f(2, 1.5f, 0) - seat.pose().position).normalized();
  EXPECT_LT(seat.pose().position.x(), 2);
  EXPECT_LT(seat.pose().position.z(), 0);
  EXPECT_GT(normal.dot(toEyes), 0.9f);
}

TEST(XrPanelSeat, TroubleComesBeforeTheEyesAndGoesBack) {
  PanelSeat seat;
  seat.seat(headAt({0, 1.6f, 0}, 0));
  const Pose before = seat.pose();
  seat.comeBefore(headAt({0, 1.6f, 0}, kPi));
  EXPECT_NEAR(seat.pose().position.z(), 0.45f, 1e-4f);
  EXPECT_LT(seat.pose().position.z(), Placement::kArmLength) << "the scene must not hide it";
  EXPECT_NEAR(seat.pose().position.x(), 0, 1e-4f);
  seat.comeBack();
  EXPECT_TRUE(seat.pose().position.isApprox(before.position));
}

}  // namespace
}  // namespace clothstream::xr
