// SPDX-License-Identifier: MIT
// Requests about scenes that are answered at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/device_thread.h"
#include "server/hosting/scene_registry.h"
#include "server/identity/identity.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

using identity::Identity;

// Thread-safe. The caller has checked that the peer may do what it asks for.
class SceneRequests {
 public:
  // The arguments must outlive this.
  SceneRequests(telemetry::ServerMetrics& metrics, const SceneRegistry& scenes, DeviceThread& device);

  // Only scenes that this peer may use.
  v1::ListScenesResponse list(const Identity& by) const;
  // Refuses a definition of more than `maxBytes`. If its meshes are larger, that takes no time.
  tl::expected<v1::GetSceneResponse, v1::Error> get(
      const v1::GetSceneRequest& request,
      std::size_t maxBytes = std::numeric_limits<std::size_t>::max()) const;
  // Pauses, resumes, resets or seeks a scene. `participant` asks; 0 means a peer outside the scene.
  tl::expected<v1::ControlSceneResponse, v1::Error> control(const v1::ControlSceneRequest& request,
                                                            std::uint64_t participant);
  tl::expected<v1::ListBansResponse, v1::Error> listBans(const v1::ListBansRequest& request) const;
  tl::expected<v1::LiftBanResponse, v1::Error> liftBan(const v1::LiftBanRequest& request);

 private:
  telemetry::ServerMetrics& metrics_;
  const SceneRegistry& scenes_;
  DeviceThread& device_;
};

}  // namespace clothstream::hosting
