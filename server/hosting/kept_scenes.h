// SPDX-License-Identifier: MIT
// Scenes that survive the end of the server, if it has a store.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/hosting/server_options.h"
#include "server/scene/checkpoint.h"
#include "server/scene/live_scene.h"

namespace clothstream::hosting {

// Thread-safe. Without a store there are no saved scenes, and the other functions that need it do nothing.
class KeptScenes {
 public:
  // `newestParticipant`: newest number of a participant of the server. The arguments must outlive this.
  KeptScenes(const ServerOptions& options, std::atomic<std::uint64_t>& newestParticipant);

  // Continues a scene that the server starts with, if a state of it is kept, and keeps it from now on.
  void restore(const std::shared_ptr<scene::LiveScene>& scene) const;
  // Scenes of earlier runs that peers created (SceneStore::takeCreated()).
  std::vector<scene::SavedScene> takeCreated() const;
  // Gives a saved state to a scene that does not run yet. No later participant gets a number of a saved one.
  void resume(scene::LiveScene& scene, scene::SavedScene saved) const;

  // Keeps a scene that is created, before it runs.
  void keep(const std::shared_ptr<scene::LiveScene>& scene) const;
  // Forgets one that was deleted.
  void forget(const scene::LiveScene& scene) const;
  // Waits for a moment until the scene, or its removal, is on the disk.
  void flush(const scene::LiveScene& scene) const;
  // Waits for a moment until all scenes are on the disk.
  void flush() const;

 private:
  const ServerOptions& options_;
  std::atomic<std::uint64_t>& newestParticipant_;
};

}  // namespace clothstream::hosting
