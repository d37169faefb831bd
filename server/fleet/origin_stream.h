// SPDX-License-Identifier: MIT
// One scene of an origin, as edges receive it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "server/delivery/relay.h"
#include "server/fleet/nats.h"
#include "server/fleet/origin_tunnels.h"
#include "server/hosting/scene_server.h"
#include "server/scene/live_scene.h"

namespace clothstream::fleet {

// Each frame and event is sent once, whatever the number of edges, and only while an edge needs it.
class OriginStream {
 public:
  // `continues`: stream of another server that this one will replace; 0 for none. All references must outlive
  // it.
  OriginStream(hosting::SceneServer& server, Nats& nats, OriginTunnels& tunnels,
               const std::shared_ptr<scene::LiveScene>& scene, std::uint64_t continues = 0);
  ~OriginStream();
  OriginStream(const OriginStream&) = delete;
  OriginStream& operator=(const OriginStream&) = delete;

  const std::shared_ptr<scene::LiveScene>& scene() const { return scene_; }
  std::uint64_t id() const { return id_; }
  const std::string& subject() const { return subject_; }
  // Whether the scene has begun again since, so that its ticks are no longer those of this stream.
  bool isOver() const { return scene_->restarts != restarts_; }
  // Until a scene that comes from another server runs here, it is only prepared.
  bool isPrepared() const { return prepared_; }
  void run() { prepared_ = false; }

  v1::OfferedScene offer() const;

 private:
  // Description with this content, if an edge asked for a part of it a short while ago, or else the newest
  // one. Parameters that change meanwhile come as events.
  std::shared_ptr<const delivery::DescriptionChunks> description(std::uint64_t content);

  struct Given {
    std::shared_ptr<const delivery::DescriptionChunks> chunks;
    schedule::Clock::time_point at{};
  };

  hosting::SceneServer& server_;
  OriginTunnels& tunnels_;
  const std::shared_ptr<scene::LiveScene> scene_;
  const std::uint64_t id_, continues_;
  const std::uint32_t restarts_;
  std::atomic<bool> prepared_;
  const std::string subject_;
  const std::shared_ptr<delivery::Relay> relay_;
  std::vector<Given> given_;  // used by the thread of NATS
  std::unique_ptr<Nats::Subscription> interest_, description_, up_;
};

}  // namespace clothstream::fleet
