// SPDX-License-Identifier: MIT
// What a server's connections share.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/stream/device_thread.h"
#include "server/stream/frame_packer.h"
#include "server/stream/live_scene.h"
#include "server/stream/scene_maker.h"
#include "server/stream/scene_server.h"
#include "server/stream/upload.h"
#include "server/telemetry/metrics.h"

namespace clothstream::stream {

class Session;

v1::SceneSummary summaryOf(const LiveScene& scene);

// Thread-safe. Members are declared in the order in which they need each other.
struct SceneServer::State {
  State(std::vector<model::Scene> definitions, ServerOptions options);
  State(std::shared_ptr<LiveScene> played, ServerOptions options);

  // nullptr if there is none of that name; an empty one is the default scene's.
  std::shared_ptr<LiveScene> find(const std::string& name) const;
  std::vector<std::shared_ptr<LiveScene>> scenesNow() const;
  void insert(std::shared_ptr<LiveScene> scene);
  void erase(const LiveScene& scene);
  // Such as: there is no scene 'x'; there are curtain, flag.
  v1::Error noSuchScene(const std::string& name) const;

  // nullptr, or the last word to a peer that is not let in: there are too many, or the server stops.
  SharedBytes add(const std::shared_ptr<Session>& session);
  std::vector<std::shared_ptr<Session>> sessionsNow() const;
  // What the scene's frames are, or were, simulated on.
  std::string deviceNameOf(const LiveScene& scene) const;
  // Whoever makes its frames looks at the scene anew.
  void wake(const LiveScene& scene);
  v1::ListScenesResponse listScenes() const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request) const;
  // All that is asked of a scene's clock goes through here.
  // `participant`: who asks; 0: somebody who is not in the scene.
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request,
                                                                 std::uint64_t participant);
  // Whether somebody who is not in it may do so to the scene of this name.
  messages::Result<void> mayFromOutside(const std::string& name, Act act) const;
  void stop();

  const ServerOptions options;
  telemetry::ServerMetrics metrics;
  UploadRoom uploads;
  std::atomic<std::uint64_t> participants{0};  // numbers given

  mutable std::mutex mutex;  // of what follows
  std::vector<std::shared_ptr<LiveScene>> scenes;
  std::vector<std::weak_ptr<Session>> sessions;
  bool stopping = false;

  FramePacker packer;
  DeviceThread device;
  SceneMaker maker;
};

}  // namespace clothstream::stream
