// SPDX-License-Identifier: MIT
// Options of a server of scenes.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/hosting/limits.h"
#include "server/messages/limits.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/defaults.h"
#include "server/scene/roles.h"
#include "server/scene/roster.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {
class Journal;
class Observer;
class SceneStore;
}  // namespace clothstream::scene

namespace clothstream::identity {
class Authenticator;
}

namespace clothstream::hosting {

// Participants of a scene whose colliders the simulation has room for.
inline constexpr std::uint32_t kMaxParticipants =
    (simulation::kMaxColliders - messages::limits::kMaxColliders) /
    messages::limits::kMaxParticipantColliders;

// Policy for surfaces of the real rooms of participants: the server refuses them, or they act on the
// cloth and their shapes are sent to no client, or to everyone in the scene.
enum class SurfacePolicy : std::uint8_t { off, own, everyone };

struct ServerOptions : Limits {
  vulkan::DeviceOptions device;
  // Scene of peers that name none. Must be one of the scenes.
  std::string defaultScene;
  // Scenes that the server starts with and that share the device like created ones. The default scene is
  // never one of them.
  std::vector<std::string> guestScenes{};
  // Sent to clients in Welcome.
  std::string serverName = "clothstream-server";
  // Scenes without subscribers keep running: the default scene from the start, others once they were joined.
  bool runAlways = false;
  // Frames per second of each scene that carry a simulation report; 0 for none.
  double reportRate = scene::kDefaultReportRate;
  // A scene that the device cannot keep up with sends fewer frames and computes fewer substeps. Otherwise
  // only its simulated time becomes slower.
  bool adaptsToLoad = true;
  std::uint32_t maxConnections = 1024;
  // Limit for each scene, disconnected participants included. At most kMaxParticipants. A peer that creates
  // a scene may set a lower limit.
  std::uint32_t maxParticipants = scene::kDefaultMaxParticipants;
  // The same of one address, other than loopback.
  std::uint32_t placesOfAddress() const {
    if (placesPerAddress >= 1) return std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::ceil(placesPerAddress * maxParticipants));
  }
  // Scenes that peers may create, in addition to those that the server starts with.
  std::uint32_t maxCreatedScenes = 16;
  // Limits what participants add by creating scenes and changing parameters.
  scene::BudgetLimits budget{};
  // Threads that encode and publish frames (FramePublisher), and threads that together predict a large frame
  // on the CPU, or begin and finish ticks (WorkerThreads). 0 means automatic for both.
  std::uint32_t encoderThreads = 0;
  // Returns the journal of a scene, or null for none. May be empty.
  std::function<std::shared_ptr<scene::Journal>(const model::Scene&)> journals{};
  // Keeps scenes beyond the end of the server; null: nothing is kept.
  std::shared_ptr<scene::SceneStore> store{};
  // Learns who joins and leaves the scenes, and what they use. May be null.
  std::shared_ptr<scene::Observer> observer{};
  // Time after stop() within which the program ends. Sent to peers.
  std::chrono::milliseconds drain{10'000};
  // A peer that sends nothing for this long is disconnected.
  std::chrono::milliseconds silence{30'000};
  scene::ReconnectGrace reconnectGrace{};
  scene::Permissions participantsMay{};
  SurfacePolicy roomSurfaces = SurfacePolicy::own;
  // Decides who peers are. Null: every peer counts as identity::local().
  std::shared_ptr<identity::Authenticator> authenticator{};
  // Created scenes of one tenant. Peers without a tenant share one number. Unset: if the authenticator has
  // keys for tokens, a quarter of maxCreatedScenes, but at least 1; else maxCreatedScenes.
  std::optional<std::uint32_t> maxScenesPerTenant{};
  // The same with its default.
  std::uint32_t scenesPerTenant() const;
};

}  // namespace clothstream::hosting
