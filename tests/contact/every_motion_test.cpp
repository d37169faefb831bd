// SPDX-License-Identifier: MIT
// Prints the figures of local contact for every motion and link.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/contact/watched_contact.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

class ContactOfEveryMotion : public GpuTest {};

TEST_F(ContactOfEveryMotion, StaysWithinFiveMillimetres) {
  fmt::print(
      "| hand | round trip | depth | without | on the server | change | besides the answer | largest |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const Motion& motion : allMotions())
    for (const double roundTrip : {0.05, 0.1, 0.15}) {
      const ContactFigures figures = watch(motion, roundTrip);
      fmt::print(
          "| {} | {:.0f} ms | {:.1f} mm | {:.1f} mm | {:.1f} mm | {:.1f} mm | {:.1f} mm | {:.0f} mm |\n",
          motion.name, 1e3 * roundTrip, 1e3 * figures.deepest, 1e3 * figures.deepestWithout,
          1e3 * figures.deepestOnServer, 1e3 * figures.change, 1e3 * figures.changeBesidesAnswer,
          1e3 * figures.largest);
      EXPECT_LE(figures.deepest, 0.005) << motion.name;
      EXPECT_LE(figures.changeBesidesAnswer, 0.005) << motion.name;
      EXPECT_EQ(figures.left, 0) << motion.name;
    }
}

}  // namespace
}  // namespace clothstream::tests
