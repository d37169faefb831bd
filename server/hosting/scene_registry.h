// SPDX-License-Identifier: MIT
// The scenes of a server by name, and places for those that will be added.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/server_options.h"
#include "server/identity/identity.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

using identity::Identity;

// Thread-safe. One lock protects scenes and places, so that a name is never given twice and the limits of
// created scenes hold.
class SceneRegistry {
 public:
  // `scenes`: those that the server starts with; the caller lets the observer observe them. The other
  // arguments must outlive this.
  SceneRegistry(const ServerOptions& options, telemetry::ServerMetrics& metrics,
                std::vector<std::shared_ptr<scene::LiveScene>> scenes = {});

  // Scene of this name, or null; the default scene for an empty name.
  std::shared_ptr<scene::LiveScene> find(const std::string& name) const;
  std::vector<std::shared_ptr<scene::LiveScene>> all() const;
  // Adds a scene, which is observed from now on. Ends the place of this name, if there is one.
  void insert(std::shared_ptr<scene::LiveScene> scene);
  void erase(const scene::LiveScene& scene);
  // Error text such as: there is no scene 'x'; there are curtain, flag. Lists only scenes that the peer may
  // use.
  v1::Error noSuchScene(const std::string& name, const Identity& by) const;
  // The same without the list, for a scene that was deleted after the peer's rights were checked.
  static v1::Error noSuchScene(const std::string& name);

  // DNS name of the other server that has a scene of this name, which may be empty; nothing if none has it.
  std::optional<std::string> otherServerOf(const std::string& scene) const;
  // `find` answers otherServerOf() from now on; null: there are no other servers. It must not call this.
  using FindServer = std::function<std::optional<std::string>(const std::string& scene)>;
  void setOtherServers(FindServer find);

  // The name and one of the places for created scenes. No other scene gets them until insert(), or until this
  // is destroyed. It must not outlive the registry.
  class Place {
   public:
    Place(Place&& other) noexcept
        : registry_(std::exchange(other.registry_, nullptr)), number_(other.number_) {}
    Place& operator=(Place&&) = delete;
    ~Place() {
      if (registry_ != nullptr) registry_->leavePlace(number_);
    }

   private:
    friend class SceneRegistry;
    Place(SceneRegistry& registry, std::uint64_t number) : registry_(&registry), number_(number) {}

    SceneRegistry* registry_;
    std::uint64_t number_;
  };
  // Takes them for a client of this tenant. `isNew`: the scene does not come from another server. Returns why
  // that is not possible.
  tl::expected<Place, v1::Error> takePlace(const std::string& name, const std::string& tenant, bool isNew);

 private:
  void leavePlace(std::uint64_t number);

  // Name and tenant of a scene that is being made or arrives.
  struct Taken {
    std::uint64_t number = 0;
    std::string name, tenant;
  };

  const ServerOptions& options_;
  telemetry::ServerMetrics& metrics_;

  mutable std::mutex mutex_;  // protects all below
  FindServer otherServers_;
  std::vector<std::shared_ptr<scene::LiveScene>> scenes_;
  std::vector<Taken> places_;
  std::uint64_t newestPlace_ = 0;
};

}  // namespace clothstream::hosting
