// SPDX-License-Identifier: MIT
#include "clients/load/hung_scene.h"

#include <cmath>

#include <gtest/gtest.h>

#include "server/messages/scene_message.h"

namespace clothstream::load {
namespace {

TEST(HungScene, ServerAcceptsAllSizesAndRates) {
  for (const std::uint32_t nodes : {kLeastNodes, 5u, 64u, 1024u, 10'000u})
    for (const std::uint32_t rate : {kLeastRate, 72u, kMostRate}) {
      v1::Scene scene = hungScene(nodes, rate);
      scene.set_name("hung");
      const auto read = messages::toScene(scene);
      ASSERT_TRUE(read.has_value()) << nodes << " nodes at " << rate << " Hz: " << read.error().text;
      EXPECT_EQ(read->simulationRate, rate);
      EXPECT_EQ(read->streamRate, rate);
      EXPECT_EQ(read->cloths.front().pins.size(), 1u);
    }
}

TEST(HungScene, HasAboutTheWantedNodes) {
  for (std::uint32_t nodes = kLeastNodes; nodes < 3000; nodes += 7) {
    const v1::Grid grid = hungScene(nodes, 72).cloths(0).grid();
    EXPECT_NEAR(grid.rows() * grid.columns(), nodes, std::sqrt(nodes)) << nodes;
  }
}

}  // namespace
}  // namespace clothstream::load
