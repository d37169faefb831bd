// SPDX-License-Identifier: MIT
// Suite creation: time to check, prepare, load and delete a scene, for each of its nodes.
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/encode/worker_threads.h"
#include "server/messages/scene_message.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_on_device.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/samples.h"
#include "tests/bench/suite.h"
#include "tests/model/meshes.h"

namespace clothstream::bench {
namespace {

using enum model::SolverKind;

struct Case {
  const char* method;
  model::SolverKind kind = massSpring;
  bool mesh = false, selfCollision = false;
};

constexpr Case kCases[] = {{"grid"},
                           {"grid, constraint", constraint},
                           {"grid, xpbd", xpbd},
                           {"grid, self-collision", massSpring, false, true},
                           {"mesh", massSpring, true},
                           {"mesh, constraint", constraint, true},
                           {"mesh, xpbd", xpbd, true}};

model::Scene sceneOf(const Case& experiment, std::uint32_t size) {
  model::Solver solver;
  solver.kind = experiment.kind;
  model::Scene scene = hungSheet(size, solver, 8);
  scene.name = "creation";
  model::Cloth& cloth = scene.cloths.front();
  const double h = scene.substepSeconds();
  const auto bearable = static_cast<float>(0.01 * double{cloth.nodeMass()} / (h * h));
  cloth.structural.stiffness = bearable;
  cloth.shear.stiffness = bearable / 2;
  cloth.bend.stiffness = bearable / 10;
  if (experiment.selfCollision)
    cloth.selfCollision = model::SelfCollision{.radius = 0.4f / static_cast<float>(size)};
  if (experiment.mesh) cloth = model::asMesh(cloth);
  return scene;
}

}  // namespace

void runCreation(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  constexpr int kRepeats = 3;
  std::vector<std::uint32_t> sizes = {128, 256, 512};
  if (settings.size) sizes = {*settings.size};
  encode::WorkerThreads workers(1);
  for (const Case& experiment : kCases) {
    // Kernels are compiled once for all scenes that need them.
    const scene::SceneOnDevice first(device, sceneOf(experiment, 16), workers);
    for (const std::uint32_t size : sizes) {
      const v1::Scene message = messages::toMessage(sceneOf(experiment, size));
      Samples check, prepare, load, remove;
      for (int i = 0; i < kRepeats; ++i) {
        std::optional<messages::Result<model::Scene>> checked;
        check.add(secondsOf([&] { checked = messages::toScene(message); }));
        if (!*checked) throw std::runtime_error(checked->error().text);
        std::unique_ptr<scene::LiveScene> live;
        prepare.add(secondsOf([&] {
          live = std::make_unique<scene::LiveScene>(**checked,
                                                    scene::SceneTerms{.created = true, .maxParticipants = 1});
        }));
        std::unique_ptr<scene::SceneOnDevice> loaded;
        load.add(
            secondsOf([&] { loaded = std::make_unique<scene::SceneOnDevice>(device, **checked, workers); }));
        remove.add(secondsOf([&] {
          loaded.reset();
          live.reset();
        }));
      }
      const auto nodes = static_cast<double>(size * size);
      const double all = check.min() + prepare.min() + load.min() + remove.min();
      add({{"suite", "creation"},
           {"method", experiment.method},
           {"size", size},
           {"check_ms", check.min() * 1e3},
           {"prepare_ms", prepare.min() * 1e3},
           {"load_ms", load.min() * 1e3},
           {"delete_ms", remove.min() * 1e3},
           {"us_per_node", all / nodes * 1e6}});
    }
  }
}

}  // namespace clothstream::bench
