// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/scene_target.h"

#include <array>
#include <memory>
#include <string>

#include "clothstream/v1/scene.pb.h"
#include "inputs.pb.h"
#include "server/messages/limits.h"
#include "server/messages/parsed_size.h"
#include "server/messages/scene_message.h"
#include "server/model/origin.h"
#include "server/scene/live_scene.h"
#include "server/simulation/assembled/assembled_tables.h"
#include "server/simulation/attachment/attachment_tables.h"
#include "server/simulation/bending/bending_tables.h"
#include "server/simulation/cloth_skin/cloth_skin_tables.h"
#include "server/simulation/mesh_tables.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/solve_tables.h"
#include "server/simulation/xpbd_tables.h"
#include "tests/serving/allocated_bytes.h"

namespace clothstream::fuzz {
namespace {

// A server permits more nodes. Time and memory are linear in nodes, so fewer nodes find the same faults in
// less time. With the fuzzer's instrumentation, a cloth of 16,376 nodes with bending took 1.1 s.
constexpr std::uint64_t kMaxNodes = 8'192;
constexpr double kMegabyte = 1e6;

// Tables that loading a scene makes on the host, all at the same time.
struct Tables {
  explicit Tables(const model::Scene& scene)
      : meshes(simulation::meshTables(scene.cloths, 64)),
        solve(simulation::solveTables(
            scene.cloths, {.nodes = 1024, .workgroup = 64, .spread = true, .mostLoops = ~0u},
            {.wholeNodes = 65'536, .workgroup = 8, .widestWorkgroup = 512, .mostLoops = 60'000})),
        assembled(simulation::assembledTables(scene.cloths,
                                              {.workgroup = 64, .wholeNodes = 1024, .rounds = 1 << 20})),
        xpbd(simulation::xpbdTables(scene.cloths, {.wholeWorkgroup = 64,
                                                   .partWorkgroup = 64,
                                                   .wholeGridNodes = 1024,
                                                   .wholeMeshNodes = 1024,
                                                   .rounds = 1 << 20})),
        bending(simulation::bendingTables(scene.cloths)),
        attachments(simulation::attachmentTables(scene, model::originOf(scene))),
        clothSkins(simulation::clothSkinTables(scene, model::originOf(scene))),
        masses(simulation::inverseMasses(scene.cloths)),
        state(simulation::startState(scene, model::originOf(scene))) {}

  simulation::MeshTables meshes;
  simulation::SolveTables solve;
  simulation::AssembledTables assembled;
  simulation::XpbdTables xpbd;
  simulation::BendingTables bending;
  simulation::AttachmentTables attachments;
  simulation::ClothSkinTables clothSkins;
  std::vector<float> masses;
  simulation::NodeState state;
};

void run(const v1::Scene& message) {
  const double before = tests::allocatedBytes();
  const auto scene = messages::toScene(message, {}, {.nodes = kMaxNodes});
  if (!scene) return require(!scene.error().text.empty(), "an error has a text");
  require(scene->nodeCount() <= kMaxNodes, "an accepted scene has a permitted number of nodes");

  const v1::Scene written = messages::toMessage(*scene);
  const auto again = messages::toScene(written, {}, {.nodes = kMaxNodes});
  require(again.has_value(), "an accepted scene is accepted again");
  require(messages::toMessage(*again).SerializeAsString() == written.SerializeAsString(),
          "a scene is written and read without a change");

  const auto budget = std::make_shared<scene::Budget>();
  budget->setSpeed({.nodeStepSeconds = 1e-9, .dispatchSeconds = 1e-6, .workgroupFactor = 4});
  scene::LiveScene live(*scene, {.created = true}, nullptr, budget);
  if (!live.charge()) return;
  require(live.description()->count() > 0, "a scene has a description");
  const Tables tables(*scene);
  const double used = tests::allocatedBytes() - before;
  const double price = model::PriceModel(*scene).bytes(*scene);
  // The message and its copies count too; they are a few megabytes at most.
  require(used <= 2 * price + 8 * kMegabyte, "the host's memory is within the price");
}

void run(const SceneInput& input) {
  if (input.has_scene()) return run(input.scene());
  const std::string& wire = input.wire();
  const auto bound = messages::parsedSize(*v1::Scene::descriptor(), std::as_bytes(std::span(wire)),
                                          messages::limits::kMaxParsedBytes);
  v1::Scene scene;
  const bool parsed = scene.ParseFromString(wire);
  if (!bound) return;
  if (parsed) {
    require(scene.SpaceUsedLong() <= *bound, "the bound of memory holds");
    run(scene);
  }
}

constexpr std::array<std::string_view, 12> kWords{"sheet", "ball", "cotton", "silk", "denim", "rail",
                                                  "top",   "a",    "b",      "",     "wool",  "part"};

}  // namespace

const Target kSceneTarget{.name = "scene",
                          .run = &runStructured<SceneInput, &run>,
                          .structure = &SceneInput::default_instance(),
                          .words = kWords};

}  // namespace clothstream::fuzz
