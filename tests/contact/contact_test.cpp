// SPDX-License-Identifier: MIT
// Local contact: the own hand does not pass visibly through the cloth while the server's answer is under way.
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/contact/watched_contact.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

class ContactTest : public GpuTest {};

TEST_F(ContactTest, HandStaysVisiblyOutsideOfTheClothAndNothingPops) {
  for (const auto& [motion, roundTrip] :
       {std::pair(flatHandAt(2), 0.15), {fingersAt(1), 0.1}, {inAndOut(), 0.05}}) {
    SCOPED_TRACE(motion.name);
    const ContactFigures figures = watch(motion, roundTrip);
    EXPECT_LE(figures.deepest, 0.005);
    EXPECT_LE(figures.changeBesidesAnswer, 0.005);
    EXPECT_EQ(figures.left, 0);
    // The cloth is in the way, and the server keeps it outside of the hand.
    EXPECT_GE(figures.deepestWithout, 0.008);
    EXPECT_LE(figures.deepestOnServer, 0.001);
  }
}

}  // namespace
}  // namespace clothstream::tests
