// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/pass_through.h"

#include <array>

#include <gtest/gtest.h>

namespace clothstream::xr {
namespace {

constexpr auto kOpaque = XR_ENVIRONMENT_BLEND_MODE_OPAQUE, kAlpha = XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND,
               kAdditive = XR_ENVIRONMENT_BLEND_MODE_ADDITIVE;

TEST(XrBlending, ShowsTheRoomByTheBestWayThatTheHeadsetHas) {
  constexpr std::array kAll{kOpaque, kAdditive, kAlpha};
  EXPECT_EQ(chooseBlending(kAll, true, true).mode, kAlpha);
  EXPECT_EQ(chooseBlending(kAll, true, true).background, Background::kTransparent);
  constexpr std::array kOnlyOpaque{kOpaque};
  EXPECT_TRUE(chooseBlending(kOnlyOpaque, true, true).usesLayer);
  EXPECT_EQ(chooseBlending(kOnlyOpaque, true, true).background, Background::kTransparent);
}

TEST(XrBlending, StaysOpaqueWithoutAWishOrAWay) {
  constexpr std::array kAll{kOpaque, kAdditive, kAlpha};
  EXPECT_EQ(chooseBlending(kAll, true, false).mode, kOpaque);
  EXPECT_FALSE(chooseBlending(kAll, true, false).usesLayer);
  constexpr std::array kOnlyOpaque{kOpaque};
  EXPECT_EQ(chooseBlending(kOnlyOpaque, false, true).background, Background::kRoom);
}

TEST(XrBlending, DisplayThatAddsLightIsAlwaysAdditive) {
  constexpr std::array kOnlyAdditive{kAdditive};
  EXPECT_EQ(chooseBlending(kOnlyAdditive, false, false).mode, kAdditive);
  EXPECT_EQ(chooseBlending(kOnlyAdditive, false, false).background, Background::kAdditive);
}

}  // namespace
}  // namespace clothstream::xr
