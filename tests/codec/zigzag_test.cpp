// SPDX-License-Identifier: MIT
#include "proto/codec/zigzag.h"

#include <limits>

#include <gtest/gtest.h>

namespace clothstream::codec {
namespace {

TEST(Zigzag, RoundTripsAtTheLimits) {
  for (const std::int32_t value : {0, -1, 1, -2, 127, -128, std::numeric_limits<std::int32_t>::max(),
                                   std::numeric_limits<std::int32_t>::min()}) {
    EXPECT_EQ(unzigzag(zigzag(value)), value);
  }
  EXPECT_EQ(zigzag(-1), 1u);
  EXPECT_EQ(zigzag(1), 2u);
}

}  // namespace
}  // namespace clothstream::codec
