// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/saved_state_target.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>

#include "clothstream/v1/saved_state.pb.h"
#include "inputs.pb.h"
#include "server/messages/scene_message.h"
#include "server/saved_state/state_message.h"

namespace clothstream::fuzz {
namespace {

// Time and memory are linear in nodes.
constexpr std::uint64_t kMaxNodes = 16'384;

// The message that the field `raw` holds, or else the parsed one.
template <typename Message>
Message messageOf(const std::string& raw, const Message& parsed) {
  if (raw.empty()) return parsed;
  Message message;
  if (!message.ParseFromString(raw)) message.Clear();
  return message;
}

void readCheckpoint(const v1::SavedCheckpoint& message, const model::Scene& start) {
  const auto checkpoint = saved_state::toCheckpoint(message, start);
  if (!checkpoint) return require(!checkpoint.error().empty(), "an error has a text");
  require(checkpoint->state.bytes.size() == start.nodeCount() * simulation::kSnapshotBytesPerNode,
          "an accepted state has every node of its scene");
  require(checkpoint->scene.cloths.size() == start.cloths.size(),
          "an accepted checkpoint has the cloths of its scene");
  require(checkpoint->grabs.slots.size() <= simulation::kMaxGrabs, "the simulation has room for all grabs");
  for (const simulation::HeldNode& held : checkpoint->state.held.nodes)
    require(held.node < start.nodeCount() && held.grab < checkpoint->grabs.slots.size(),
            "held nodes and their grabs exist");
  require(checkpoint->colliders.colliders.size() + start.colliders.size() <= simulation::kMaxColliders,
          "the simulation has room for all colliders");
  const v1::SavedCheckpoint written = saved_state::toMessage(*checkpoint);
  const auto again = saved_state::toCheckpoint(written, start);
  require(again.has_value(), "an accepted checkpoint is accepted again");
  require(saved_state::toMessage(*again).SerializeAsString() == written.SerializeAsString(),
          "a checkpoint is written and read without a change");
}

void readSession(const v1::SavedSession& message, const model::Scene& start) {
  const scene::SavedRoster roster = saved_state::toRoster(message);
  const v1::SavedSession written = saved_state::toMessage(roster, message.parameters());
  const v1::SavedSession again = saved_state::toMessage(saved_state::toRoster(written), written.parameters());
  require(again.SerializeAsString() == written.SerializeAsString(),
          "a session is written and read without a change");
  if (const auto changed = saved_state::withParameters(message.parameters(), start))
    require(changed->nodeCount() == start.nodeCount(), "parameters change no node");
}

void run(const SavedStateInput& input) {
  const auto saved = messageOf(input.raw_scene(), input.scene());
  // toScene() has no limit of nodes, because the server has accepted the scene before.
  if (!messages::toScene(saved.definition(), {}, {.nodes = kMaxNodes})) return;
  const auto start = saved_state::toScene(saved.definition());
  if (!start) return require(!start.error().empty(), "an error has a text");
  require(saved_state::isOf(saved_state::toMessage(*start, scene::SceneTerms{}), *start),
          "a scene is recognised by its size and checksum");
  static_cast<void>(saved_state::isOf(saved, *start));
  readSession(messageOf(input.raw_session(), input.session()), *start);
  readCheckpoint(messageOf(input.raw_checkpoint(), input.checkpoint()), *start);
}

constexpr std::array<std::string_view, 5> kWords{"sheet", "mesh", "ball", "rail", ""};

}  // namespace

const Target kSavedStateTarget{.name = "saved_state",
                               .run = &runStructured<SavedStateInput, &run>,
                               .structure = &SavedStateInput::default_instance(),
                               .words = kWords};

}  // namespace clothstream::fuzz
