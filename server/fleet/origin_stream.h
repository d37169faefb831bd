// SPDX-License-Identifier: MIT
// One scene of an origin, as edges receive it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "server/delivery/relay.h"
#include "server/fleet/nats.h"
#include "server/fleet/origin_tunnels.h"
#include "server/hosting/scene_server.h"

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
  // Until a scene that comes from another server runs here, it is only prepared.
  bool isPrepared() const { return prepared_; }
  void run() { prepared_ = false; }

  v1::OfferedScene offer() const;

 private:
  hosting::SceneServer& server_;
  OriginTunnels& tunnels_;
  const std::shared_ptr<scene::LiveScene> scene_;
  const std::uint64_t id_, continues_;
  std::atomic<bool> prepared_;
  const std::string subject_;
  const std::shared_ptr<delivery::Relay> relay_;
  std::unique_ptr<Nats::Subscription> interest_, description_, up_;
};

}  // namespace clothstream::fleet
