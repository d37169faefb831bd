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
#include "server/stream/scene_server.h"
#include "server/telemetry/metrics.h"

namespace clothstream::stream {

class Session;

// Thread-safe. Members are declared in the order in which they need each other.
struct SceneServer::State {
  State(std::vector<scene::Scene> definitions, ServerOptions options);

  // nullptr if there is none of that name; an empty one is the default scene's.
  LiveScene* find(const std::string& name) const;
  // Such as: there is no scene 'x'; there are curtain, flag.
  v1::Error noSuchScene(const std::string& name) const;

  // nullptr, or the last word to a peer that is not let in: there are too many, or the server stops.
  SharedBytes add(const std::shared_ptr<Session>& session);
  std::vector<std::shared_ptr<Session>> sessionsNow() const;
  v1::ListScenesResponse listScenes() const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request) const;
  void stop();

  const ServerOptions options;
  telemetry::ServerMetrics metrics;
  const std::vector<std::unique_ptr<LiveScene>> scenes;
  std::atomic<std::uint64_t> participants{0};  // numbers given

  mutable std::mutex mutex;
  std::vector<std::weak_ptr<Session>> sessions;
  bool stopping = false;

  FramePacker packer;
  DeviceThread device;
};

}  // namespace clothstream::stream
