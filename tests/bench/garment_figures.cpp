// SPDX-License-Identifier: MIT
// Suite garment: dressed figures that walk.
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "tests/bench/garment.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

constexpr const char* kFigureScene = "dress";

// Ticks of as many scenes with a figure, one after the other, as a server runs them. All move alike, so that
// their states must be the same.
void addFiguresOf(vulkan::Device& device, const Settings& settings, const RowSink& add,
                  const model::Scene& scene, std::size_t count) {
  std::vector<std::unique_ptr<Simulated>> running;
  for (std::size_t i = 0; i < count; ++i)
    running.push_back(std::make_unique<Simulated>(device, scene, simulation::SimulationOptions{}));
  Samples all;
  double spent = 0;
  for (std::uint64_t tick = 0; spent < settings.seconds || all.count() < 72; ++tick) {
    const simulation::TickInputs inputs = simulation::inputsAt(scene, tick);
    const double seconds = secondsOf([&] {
      for (const auto& simulated : running) simulated->tick(inputs);
    });
    all.add(seconds);
    spent += seconds;
  }
  for (const auto& simulated : running)
    if (simulated->status().stateHash != running[0]->status().stateHash)
      throw std::runtime_error(fmt::format("figures of the scene {} that move alike differ", scene.name));
  add(Row{{"suite", "garment"},
          {"scene", scene.name},
          {"nodes", scene.nodeCount()},
          {"figures", count},
          {"tickMsMedian", all.median() * 1e3},
          {"tickMsP99", all.p99() * 1e3}});
}

}  // namespace

void addFigures(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const auto scene = messages::loadScene(kFigureScene);
  if (!scene) throw std::runtime_error(scene.error().text);
  for (const std::size_t count : {1, 10}) addFiguresOf(device, settings, add, *scene, count);
}

}  // namespace clothstream::bench
