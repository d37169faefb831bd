// SPDX-License-Identifier: MIT
// The scenes of a server: named, simulated on one device, streamed to whoever joins through a Connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/messages/limits.h"
#include "server/model/scene.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/stream/roster.h"
#include "server/vulkan/device.h"

namespace clothstream::stream {

class FrameSource;
class Journal;

// The simulation has room for the colliders of so many.
inline constexpr std::uint32_t kMostParticipants =
    (simulation::kMaxColliders - messages::limits::kMaxColliders) /
    messages::limits::kMaxParticipantColliders;

struct ServerOptions {
  vulkan::DeviceOptions device;
  // Joined by whoever names no scene; must be one of the scenes.
  std::string defaultScene;
  // Sent to clients in Welcome.
  std::string serverName = "clothstream-server";
  // A scene sleeps while nobody is in it, unless this is set: then the default scene runs from the start, and
  // others from when somebody first joins them.
  bool runAlways = false;
  // Frames of a scene that tell how its simulation does, a second; 0: none.
  double reportRate = 4;
  std::uint32_t maxConnections = 1024;
  // Of a scene, those who are held included; who creates one may ask for less. At most kMostParticipants.
  std::uint32_t maxParticipants = kDefaultMaxParticipants;
  // Beside those that the server starts with; 0: peers make none.
  std::uint32_t maxCreatedScenes = 16;
  // That predict large frames where the host does; 0: as many as suit the machine (EncoderThreads).
  std::uint32_t encoderThreads = 0;
  // Of what all peers upload at the same time.
  std::size_t maxUploadBytes = std::size_t{256} << 20;
  // Gives each scene its journal, or null for none; may be empty.
  std::function<std::shared_ptr<Journal>(const model::Scene&)> journals{};
  // A peer that sends nothing for this long is cut off.
  std::chrono::milliseconds silence{30'000};
  // Of who is cut off.
  Holding holding{};
  Permissions participantsMay{};
  // Who is not in a scene may pause, reset and delete it; else only where nobody owns it.
  bool outsideControl = true;
};

// Called once, on any thread; must only pass the word on.
using CreateDone = std::function<void(tl::expected<v1::CreateSceneResponse, v1::Error>)>;
using StartRecordingDone = std::function<void(tl::expected<v1::StartRecordingResponse, v1::Error>)>;
using StopRecordingDone = std::function<void(tl::expected<v1::StopRecordingResponse, v1::Error>)>;
using DeleteDone = std::function<void(tl::expected<v1::DeleteSceneResponse, v1::Error>)>;

// Thread-safe. Three threads of its own: one owns the device and runs every scene's ticks, one makes packets
// of frames, one makes scenes.
class SceneServer {
 public:
  // The scenes must be valid (server/messages) and their names unique. Throws vulkan::DeviceError, or
  // std::runtime_error where the device has no room for the default scene or it is not among them (naming
  // those there are).
  SceneServer(std::vector<model::Scene> scenes, ServerOptions options);
  // Of one scene that is not simulated here, the default one; needs no device, and can make no others.
  SceneServer(std::string name, std::shared_ptr<FrameSource> source, ServerOptions options);
  // Stops. Every Connection must be gone.
  ~SceneServer();
  SceneServer(const SceneServer&) = delete;
  SceneServer& operator=(const SceneServer&) = delete;

  // The unary calls; inside a stream they are answered by the same functions.
  v1::ListScenesResponse listScenes() const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request) const;
  // Outside a stream nothing can have been uploaded.
  void createScene(const v1::CreateSceneRequest& request, CreateDone done);
  void deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done);
  void startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done);
  void stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done);
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request);

  // Tells everybody that the server stops, and finishes every connection, now and from here on.
  void stop();

  // Of the device in use, also after it was rebuilt.
  vulkan::DeviceInfo deviceInfo() const;
  const std::string& defaultScene() const;

  // Histograms and counters since the start, as a table for people.
  std::string report() const;

  // For this room alone.
  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::stream
