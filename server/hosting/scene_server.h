// SPDX-License-Identifier: MIT
// The scenes of a server: named, simulated on one device, and joined by sessions.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/delivery/envelope.h"
#include "server/delivery/wire_types.h"
#include "server/hosting/limits.h"
#include "server/identity/identity.h"
#include "server/messages/limits.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/defaults.h"
#include "server/scene/roles.h"
#include "server/scene/roster.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {
class FrameSource;
class Journal;
class LiveScene;
class Observer;
class SceneStore;
}  // namespace clothstream::scene

namespace clothstream::identity {
class Authenticator;
}

namespace clothstream::hosting {

using identity::Identity;

// Participants of a scene whose colliders the simulation has room for.
inline constexpr std::uint32_t kMaxParticipants =
    (simulation::kMaxColliders - messages::limits::kMaxColliders) /
    messages::limits::kMaxParticipantColliders;

// Time at the start of an upload to which minUploadRate does not apply.
inline constexpr std::chrono::seconds kUploadPatience{5};

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
    return static_cast<std::uint32_t>(std::ceil(placesPerAddress * maxParticipants));
  }
  // Scenes that peers may create, in addition to those that the server starts with.
  std::uint32_t maxCreatedScenes = 16;
  // Limits what participants add by creating scenes and changing parameters.
  scene::BudgetLimits budget{};
  // Threads that predict large frames on the CPU; 0 means automatic (EncoderThreads).
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
  // Decides who peers are. Null: every peer counts as identity::local().
  std::shared_ptr<identity::Authenticator> authenticator{};
  // Created scenes of one tenant. Peers without a tenant share one number. Unset: if the authenticator has
  // keys for tokens, a quarter of maxCreatedScenes, but at least 1; else maxCreatedScenes.
  std::optional<std::uint32_t> maxScenesPerTenant{};
};

// Returns whether the peer still waits for the answer. Called on any thread; must not block.
using Wanted = std::function<bool()>;
// Called once, on any thread. Must not block.
using CreateDone = std::function<void(tl::expected<v1::CreateSceneResponse, v1::Error>)>;
using StartRecordingDone = std::function<void(tl::expected<v1::StartRecordingResponse, v1::Error>)>;
using StopRecordingDone = std::function<void(tl::expected<v1::StopRecordingResponse, v1::Error>)>;
using DeleteDone = std::function<void(tl::expected<v1::DeleteSceneResponse, v1::Error>)>;

// Thread-safe. DeviceThread runs the ticks of all scenes, FramePublisher encodes and publishes frames,
// SceneMaker creates scenes and SceneLoader loads them: one thread each. EncoderThreads may add more.
class SceneServer {
 public:
  // The scenes must be valid (server/messages) and their names unique. Throws vulkan::DeviceError, or
  // std::runtime_error if the device has no room for the default scene, or if the default scene is not among
  // the scenes (the text lists them).
  SceneServer(std::vector<model::Scene> scenes, ServerOptions options);
  // Server of one scene that is not simulated; it is the default scene. Needs no device and can create no
  // other scenes.
  SceneServer(std::string name, std::shared_ptr<scene::FrameSource> source, ServerOptions options);
  // Server without scenes, of which add() makes some. Needs no device and can create no others. A peer that
  // names no scene gets options.defaultScene or, if that is empty, the first one.
  explicit SceneServer(ServerOptions options);
  // Stops. Every session must have ended.
  ~SceneServer();
  SceneServer(const SceneServer&) = delete;
  SceneServer& operator=(const SceneServer&) = delete;

  // Adds a scene that is not simulated. While there is another one of this name, peers get that. It has room
  // for as many participants as the server for connections.
  std::shared_ptr<scene::LiveScene> add(std::string name, std::shared_ptr<scene::FrameSource> source);
  // Ends such a scene, with this as the last message to its participants.
  void remove(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last);

  // Unary calls of a peer that is not in a stream. By default the program itself calls.
  v1::ListScenesResponse listScenes(const Identity& by = identity::local()) const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request,
                                                         const Identity& by = identity::local()) const;
  // Refuses a request for uploaded content, because uploads need a stream.
  void createScene(const v1::CreateSceneRequest& request, const CreateDone& done,
                   const Identity& by = identity::local(), Wanted wanted = {});
  void deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done,
                   const Identity& by = identity::local());
  void startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done,
                      const Identity& by = identity::local());
  void stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done,
                     const Identity& by = identity::local());
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request,
                                                                 const Identity& by = identity::local());

  // Announces that the server stops, and closes every session, present and future.
  void stop();

  // Device in use, also after it was rebuilt.
  vulkan::DeviceInfo deviceInfo() const;

  // Histograms and counters since the start, as a table for people.
  std::string report() const;

  // For sessions, monitoring and tests.
  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::hosting
