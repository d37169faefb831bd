// SPDX-License-Identifier: MIT
// The scenes of a server: named, simulated on one device, and joined by sessions.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "server/delivery/envelope.h"
#include "server/delivery/frame_publisher.h"
#include "server/hosting/access.h"
#include "server/hosting/authentication.h"
#include "server/hosting/connections.h"
#include "server/hosting/created_scenes.h"
#include "server/hosting/datagram_gate.h"
#include "server/hosting/device_thread.h"
#include "server/hosting/kept_scenes.h"
#include "server/hosting/scene_maker.h"
#include "server/hosting/scene_registry.h"
#include "server/hosting/scene_requests.h"
#include "server/hosting/server_options.h"
#include "server/hosting/surface_maker.h"
#include "server/hosting/unary_calls.h"
#include "server/hosting/upload_budget.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/frame_source.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

// Owns the parts of a server, starts them and stops them; others use the parts. Thread-safe, like each of its
// parts. DeviceThread runs the ticks of all scenes, SceneMaker creates scenes and SceneLoader loads them, and
// this class looks after peers: one thread each. FramePublisher encodes and publishes frames on several.
class SceneServer {
 public:
  // The definitions must be valid (server/messages) and their names unique. Throws vulkan::DeviceError, or
  // std::runtime_error if the device has no room for the default scene, or if the default scene is not among
  // the scenes (the text lists them).
  SceneServer(std::vector<model::Scene> definitions, ServerOptions given);
  // Server of one scene that is not simulated; it is the default scene. Needs no device and can create no
  // other scenes.
  SceneServer(std::string name, std::shared_ptr<scene::FrameSource> source, ServerOptions given);
  // Server without scenes, of which add() makes some. Needs no device and can create no others. A peer that
  // names no scene gets the options' default scene or, if that is empty, the first one.
  explicit SceneServer(ServerOptions given);
  // Stops. Every session must have ended.
  ~SceneServer();
  SceneServer(const SceneServer&) = delete;
  SceneServer& operator=(const SceneServer&) = delete;

  // Adds a scene that is not simulated. While there is another one of this name, peers get that. It has room
  // for as many participants as the server for connections.
  std::shared_ptr<scene::LiveScene> add(std::string name, std::shared_ptr<scene::FrameSource> source);
  // Ends such a scene, with this as the last message to its participants.
  void remove(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last);

  // Announces that the server stops, and closes every session, present and future.
  void stop();

  // Name of the device that simulates the scene's frames, or simulated them.
  std::string deviceNameOf(const scene::LiveScene& scene) const;
  // Histograms and counters since the start, as a table for people.
  std::string report() const;

  // The parts, in the order in which they need each other.
  const ServerOptions options;
  telemetry::ServerMetrics metrics;
  UploadBudget uploads;
  const std::shared_ptr<scene::Budget> budget;
  std::atomic<std::uint64_t> newestParticipant{0};  // its number
  // Opens datagrams for peers; null: they are off. The gate must outlive the sessions of its peers.
  std::atomic<DatagramGate*> datagrams{nullptr};
  const KeptScenes kept;
  SceneRegistry scenes;
  Connections connections;
  Authentication authentication;
  const Access access;

 private:
  // `newest`: number of the newest participant.
  SceneServer(std::vector<model::Scene>&& definitions, ServerOptions&& given, std::uint64_t newest);
  // The scenes that the server starts with. They continue from their kept states.
  std::vector<std::shared_ptr<scene::LiveScene>> startScenes(std::vector<model::Scene> definitions) const;
  // Checks peers about once a second until a request to stop.
  void keepHouse(const std::stop_token& stop);
  // Disconnects silent peers, removes participants whose reconnect grace has ended, and divides the room for
  // poses. Holds a lock of one peer or scene at a time.
  void checkPeers(const std::stop_token& stop);

 public:
  delivery::FramePublisher publisher;
  DeviceThread device;
  CreatedScenes created;
  SceneMaker maker;
  SurfaceMaker surfaceMaker;
  SceneRequests requests;
  UnaryCalls unaryCalls;

 private:
  std::jthread housekeeping_;  // last, because it uses the parts; runs from when peers can join
};

}  // namespace clothstream::hosting
