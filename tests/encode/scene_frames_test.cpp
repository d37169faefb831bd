// SPDX-License-Identifier: MIT
// The promise of the max error, over the scenes that come with the program.
#include "server/messages/scene_file.h"
#include "tests/encode/encoding.h"

namespace clothstream::tests {
namespace {

class FramesOfNamedScene : public GpuTest, public testing::WithParamInterface<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, FramesOfNamedScene, testing::ValuesIn(messages::namedScenes()),
                         [](const auto& name) { return name.param; });

// Encoding checks each frame, packet and vertex.
TEST_P(FramesOfNamedScene, KeepsItsMaxErrorForSeconds) {
  const model::Scene scene = *messages::loadScene(GetParam());
  Encoding encoding(scene);
  // A second of the gown takes more than half a minute on lavapipe.
  const std::uint64_t ticks = (scene.name == "gown" ? 1 : 6) * std::uint64_t{scene.simulationRate};
  for (std::uint64_t tick = 1; tick <= ticks && !HasFailure(); ++tick)
    encoding.tick(tick, tick % 100 == 0, simulation::inputsAt(scene, tick - 1));
}

}  // namespace
}  // namespace clothstream::tests
