// SPDX-License-Identifier: MIT
#include "server/scene/snapshot_message.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>

#include <fmt/format.h>

#include "server/messages/vectors.h"

namespace clothstream::scene {
namespace {

using simulation::HeldNode;
using simulation::HeldNodes;

constexpr std::size_t kVectorBytes = 12;
static_assert(sizeof(simulation::GasState) == 8);  // as in the message

void write(const HeldNodes& held, v1::HeldNodes& message) {
  std::string& places = *message.mutable_places();
  places.resize(held.nodes.size() * kVectorBytes);
  char* to = places.data();
  for (const HeldNode& node : held.nodes) {
    message.add_nodes(node.node);
    message.add_grabs(node.grab);
    std::memcpy(to, node.place.data(), kVectorBytes);
    to += kVectorBytes;
  }
  for (const simulation::GrabStatus& grab : held.grabs) {
    message.add_taken(grab.taken);
    message.add_slipped(grab.slipped);
  }
  const bool anyPlace = std::ranges::any_of(
      held.grabs, [](const simulation::GrabStatus& grab) { return grab.offset != model::Vec3::Zero(); });
  if (!anyPlace) return;
  for (const simulation::GrabStatus& grab : held.grabs)
    message.mutable_offsets()->append(reinterpret_cast<const char*>(grab.offset.data()), kVectorBytes);
}

tl::expected<HeldNodes, std::string> toHeldNodes(const v1::HeldNodes& message, std::uint32_t nodeCount) {
  const auto wrong = [] { return tl::unexpected(std::string("holds nodes that do not fit its scene")); };
  const auto nodes = static_cast<std::size_t>(message.nodes_size());
  if (message.grabs_size() != message.nodes_size() || message.places().size() != nodes * kVectorBytes ||
      nodes > nodeCount || message.slipped_size() != message.taken_size() ||
      static_cast<std::size_t>(message.taken_size()) > simulation::kMaxGrabs)
    return wrong();
  HeldNodes held;
  const char* from = message.places().data();
  for (int i = 0; i < message.nodes_size(); ++i, from += kVectorBytes) {
    HeldNode node{.node = message.nodes(i), .grab = message.grabs(i)};
    if (node.node >= nodeCount || node.grab >= static_cast<std::uint32_t>(message.taken_size()))
      return wrong();
    std::memcpy(node.place.data(), from, kVectorBytes);
    held.nodes.push_back(node);
  }
  const std::string& offsets = message.offsets();
  const auto grabs = static_cast<std::size_t>(message.taken_size());
  if (!offsets.empty() && offsets.size() != grabs * kVectorBytes) return wrong();
  for (std::size_t i = 0; i < grabs; ++i) {
    simulation::GrabStatus& grab = held.grabs.emplace_back();
    grab.taken = message.taken(static_cast<int>(i));
    grab.slipped = message.slipped(static_cast<int>(i));
    if (!offsets.empty()) std::memcpy(grab.offset.data(), offsets.data() + i * kVectorBytes, kVectorBytes);
  }
  return held;
}

}  // namespace

void write(const simulation::StateSnapshot& snapshot, v1::Checkpoint& message) {
  message.set_tick(snapshot.tick);
  message.set_state(snapshot.bytes.data(), snapshot.bytes.size());
  if (!snapshot.origin.isZero(0)) messages::write(snapshot.origin, *message.mutable_origin());
  if (!snapshot.gas.empty())
    message.set_gas(snapshot.gas.data(), snapshot.gas.size() * sizeof(simulation::GasState));
  message.set_grips_hold(!snapshot.held.nodes.empty());
  if (!snapshot.held.grabs.empty()) write(snapshot.held, *message.mutable_held());
}

tl::expected<simulation::StateSnapshot, std::string> toSnapshot(const v1::Checkpoint& message,
                                                                std::uint32_t nodeCount) {
  if (message.state().size() != std::size_t{nodeCount} * simulation::kSnapshotBytesPerNode)
    return tl::unexpected(fmt::format("does not fit the {} nodes of its scene", nodeCount));
  const auto state = std::as_bytes(std::span(message.state()));
  simulation::StateSnapshot snapshot{message.tick(), {state.begin(), state.end()}};
  snapshot.origin = {message.origin().x(), message.origin().y(), message.origin().z()};
  if (!(snapshot.origin.cwiseAbs().maxCoeff() <= simulation::kWorldExtent))
    return tl::unexpected(std::string("has an origin outside of the world"));
  const std::string& gas = message.gas();
  if (gas.size() % sizeof(simulation::GasState) != 0 || gas.size() / sizeof(simulation::GasState) > nodeCount)
    return tl::unexpected(std::string("has the gas of another scene"));
  snapshot.gas.resize(gas.size() / sizeof(simulation::GasState));
  std::memcpy(snapshot.gas.data(), gas.data(), gas.size());
  for (const simulation::GasState& each : snapshot.gas)
    if (!std::isfinite(each.volume) || !(each.squaredSubstep >= 0 && each.squaredSubstep <= 1))
      return tl::unexpected(std::string("has gas with a number out of range"));
  if (message.has_held()) {
    auto held = toHeldNodes(message.held(), nodeCount);
    if (!held) return tl::unexpected(std::move(held).error());
    snapshot.held = std::move(*held);
  }
  return snapshot;
}

}  // namespace clothstream::scene
