// SPDX-License-Identifier: MIT
// What peers may do to scenes, by their identity.
#pragma once

#include <string>

#include "server/hosting/scene_registry.h"
#include "server/hosting/server_options.h"
#include "server/identity/identity.h"
#include "server/messages/field_error.h"
#include "server/scene/live_scene.h"
#include "server/scene/roles.h"

namespace clothstream::hosting {

using identity::Identity;

// Thread-safe. Each function that returns a result returns PERMISSION_DENIED, with the reason, if the peer
// may not do this, and NOT_FOUND if there is no such scene.
class Access {
 public:
  // The arguments must outlive this.
  Access(const ServerOptions& options, const SceneRegistry& scenes);

  messages::Result<void> mayUse(const Identity& by, const std::string& scene) const;
  messages::Result<void> mayCreate(const Identity& by) const;
  // For peers outside the scene of this name.
  messages::Result<void> mayFromOutside(const Identity& by, const std::string& scene,
                                        scene::Action action) const;
  // Returns whether a peer with a token of another tenant has created the scene.
  static bool isOfOtherTenant(const Identity& by, const scene::LiveScene& scene);

 private:
  const ServerOptions& options_;
  const SceneRegistry& scenes_;
};

}  // namespace clothstream::hosting
