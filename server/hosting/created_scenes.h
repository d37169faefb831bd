// SPDX-License-Identifier: MIT
// Scenes that peers create: they begin here, come from other servers or earlier runs, and are removed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"
#include "server/hosting/device_thread.h"
#include "server/hosting/kept_scenes.h"
#include "server/hosting/scene_registry.h"
#include "server/hosting/server_options.h"
#include "server/model/cancellation.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/checkpoint.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

class ArrivingScene;

// Thread-safe. A created scene that may run is charged to the budget, the device thread has it, and it is
// kept if the server keeps scenes. remove() ends all of this.
class CreatedScenes {
 public:
  // The arguments must outlive this.
  CreatedScenes(const ServerOptions& options, telemetry::ServerMetrics& metrics,
                std::shared_ptr<scene::Budget> budget, SceneRegistry& scenes, const KeptScenes& kept,
                DeviceThread& device);

  // Continues the scenes of an earlier run. One that exceeds the budget or the number of scenes is listed,
  // but does not run; it stays kept. Must be called at most once, before peers can join.
  void restore();
  // Creates a scene for a peer of this tenant and waits until it can run. Returns why it cannot. Throws
  // model::Cancelled, or what the journal throws; then nothing has changed.
  tl::expected<std::shared_ptr<scene::LiveScene>, v1::Error> create(model::Scene definition,
                                                                    std::uint32_t maxParticipants,
                                                                    const std::string& tenant,
                                                                    const model::Cancellation& cancellation);
  // Loads a scene that a client created on another server, and that still runs there. Returns why it cannot
  // run here.
  tl::expected<ArrivingScene, std::string> prepareArrival(scene::SavedScene saved);
  // Removes a scene, because a peer deleted it or another server has it now. `last` is the last message to
  // its participants.
  void remove(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last);

 private:
  friend class ArrivingScene;

  // A scene of an earlier run or of another server. It has only the start of `saved`.
  std::shared_ptr<scene::LiveScene> madeFrom(const scene::SavedScene& saved) const;
  // Removes a scene that cannot be used, because its creation was cancelled or has failed.
  void undoCreation(const std::shared_ptr<scene::LiveScene>& scene);
  // Continues a prepared scene here. Throws std::runtime_error if that fails.
  void startArrived(const std::shared_ptr<scene::LiveScene>& scene, scene::SavedScene saved);

  const ServerOptions& options_;
  telemetry::ServerMetrics& metrics_;
  const std::shared_ptr<scene::Budget> budget_;
  SceneRegistry& scenes_;
  const KeptScenes& kept_;
  DeviceThread& device_;
};

// A scene of another server that is loaded here and has a place. Until start() peers cannot join it. Belongs
// to one thread. It must not outlive the created scenes.
class ArrivingScene {
 public:
  ArrivingScene(ArrivingScene&& other) noexcept = default;
  ArrivingScene& operator=(ArrivingScene&&) = delete;
  // Abandons a scene that was not started.
  ~ArrivingScene() { abandon(); }

  // Null after abandon().
  const std::shared_ptr<scene::LiveScene>& scene() const { return scene_; }
  // Continues the scene with this session and state; its definition is not used. Must be called at most once.
  // Throws std::runtime_error if that fails; the scene can then only be abandoned.
  void start(scene::SavedScene saved);
  // Removes a scene that was not started.
  void abandon();

 private:
  friend class CreatedScenes;
  ArrivingScene(CreatedScenes& created, std::shared_ptr<scene::LiveScene> scene, SceneRegistry::Place place)
      : created_(&created), scene_(std::move(scene)), place_(std::move(place)) {}

  CreatedScenes* created_;
  std::shared_ptr<scene::LiveScene> scene_;
  std::optional<SceneRegistry::Place> place_;  // empty once the scene was started
};

}  // namespace clothstream::hosting
