// SPDX-License-Identifier: MIT
// State of a server that its sessions use: scenes, peers, and requests about scenes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/delivery/frame_publisher.h"
#include "server/hosting/device_thread.h"
#include "server/hosting/peer.h"
#include "server/hosting/scene_maker.h"
#include "server/hosting/scene_server.h"
#include "server/hosting/upload_budget.h"
#include "server/scene/budget.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

v1::Error toMessage(const messages::FieldError& error);
v1::SceneSummary summaryOf(const scene::LiveScene& scene);

// Thread-safe. Members are declared in the order in which they need each other.
struct SceneServer::State {
  State(std::vector<model::Scene> definitions, ServerOptions options);
  State(std::shared_ptr<scene::LiveScene> played, ServerOptions options);

  // Scene of this name, or null; the default scene for an empty name.
  std::shared_ptr<scene::LiveScene> find(const std::string& name) const;
  std::vector<std::shared_ptr<scene::LiveScene>> scenesNow() const;
  void insert(std::shared_ptr<scene::LiveScene> scene);
  void erase(const scene::LiveScene& scene);
  // Error text such as: there is no scene 'x'; there are curtain, flag.
  v1::Error noSuchScene(const std::string& name) const;

  // Admits a peer. Returns null, or the last message to the peer if it is refused, because there are too many
  // peers or the server stops.
  delivery::SharedBytes admit(const std::shared_ptr<Peer>& peer);
  std::vector<std::shared_ptr<Peer>> peersNow() const;
  // Name of the device that simulates the scene's frames, or simulated them.
  std::string deviceNameOf(const scene::LiveScene& scene) const;
  // Wakes the thread that makes the scene's frames, after a change of its subscribers or its clock.
  void wake(const scene::LiveScene& scene);
  v1::ListScenesResponse listScenes() const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request) const;
  // Pauses, resumes, resets or seeks a scene. `participant` asks; 0 means a peer outside the scene. The
  // caller has checked that the peer may do so.
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request,
                                                                 std::uint64_t participant);
  // Returns an error if peers outside the scene of this name may not do this.
  messages::Result<void> mayFromOutside(const std::string& name, scene::Action action) const;
  void stop();

  const ServerOptions options;
  telemetry::ServerMetrics metrics;
  UploadBudget uploads;
  const std::shared_ptr<scene::Budget> budget;
  std::atomic<std::uint64_t> participants{0};  // newest participant number

  mutable std::mutex mutex;  // protects the next three
  std::vector<std::shared_ptr<scene::LiveScene>> scenes;
  std::vector<std::weak_ptr<Peer>> peers;
  bool stopping = false;

  delivery::FramePublisher publisher;
  DeviceThread device;
  SceneMaker maker;
};

}  // namespace clothstream::hosting
