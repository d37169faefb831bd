// SPDX-License-Identifier: MIT
// Words of residuals as the kernels pack them.
#include "server/encode/residual_words.h"

#include <array>

#include <gtest/gtest.h>

#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {
namespace {

using codec::hierarchical::ChunkResiduals;
using codec::hierarchical::kAlongNormal;
using codec::hierarchical::kAlongU;
using codec::hierarchical::kAlongV;

constexpr std::uint32_t wordOf(std::int16_t low, std::uint32_t high) {
  return static_cast<std::uint16_t>(low) | high << 16;
}

TEST(ResidualWords, HaveSignedResidualsAndScales) {
  const std::array first{wordOf(-5, static_cast<std::uint16_t>(-32768)), wordOf(32767, 1)};
  const std::array second{wordOf(-1, 31u | 2u << 5 | 17u << 10), wordOf(0, 0)};
  ChunkResiduals out{};
  EXPECT_TRUE(unpackResiduals({.first = first, .second = second, .wide = {}}, out));
  EXPECT_EQ(out.residuals[kAlongU][0], -5);
  EXPECT_EQ(out.residuals[kAlongV][0], -32768);
  EXPECT_EQ(out.residuals[kAlongNormal][0], -1);
  EXPECT_EQ(out.scales[kAlongU][0], 31);
  EXPECT_EQ(out.scales[kAlongV][0], 2);
  EXPECT_EQ(out.scales[kAlongNormal][0], 17);
  EXPECT_EQ(out.residuals[kAlongU][1], 32767);
  EXPECT_EQ(out.residuals[kAlongV][1], 1);
  EXPECT_FALSE(out.anyStays);
}

TEST(ResidualWords, ScalesAloneAreNoResiduals) {
  const std::array first{0u}, second{wordOf(0, 31u)};
  ChunkResiduals out{};
  out.anyStays = true;
  EXPECT_FALSE(unpackResiduals({.first = first, .second = second, .wide = {}}, out));
  EXPECT_FALSE(out.anyStays);
}

TEST(ResidualWords, FlagMeansStaysOrWide) {
  const std::array first{0u, 1u, 7u}, second{shared::kSpecialWord, shared::kSpecialWord, 0u};
  const std::array wide{1, 1, 1, 70'000, -80'000, 90'000, 1, 1, 1};
  ChunkResiduals out{};
  EXPECT_TRUE(unpackResiduals({.first = first, .second = second, .wide = wide}, out));
  EXPECT_TRUE(out.anyStays);
  EXPECT_TRUE(out.stays[0]);
  EXPECT_FALSE(out.stays[1]);
  EXPECT_FALSE(out.stays[2]);
  EXPECT_EQ(out.residuals[kAlongU][1], 70'000);
  EXPECT_EQ(out.residuals[kAlongV][1], -80'000);
  EXPECT_EQ(out.residuals[kAlongNormal][1], 90'000);
  EXPECT_EQ(out.residuals[kAlongU][2], 7);
}

}  // namespace
}  // namespace clothstream::encode
