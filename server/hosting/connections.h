// SPDX-License-Identifier: MIT
// The connected peers of a server, and how many there may be.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "server/delivery/envelope.h"
#include "server/hosting/peer.h"
#include "server/hosting/server_options.h"
#include "server/identity/identity.h"
#include "server/scene/subject.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

using identity::Identity;

// Thread-safe. Calls peers without its lock.
class Connections {
 public:
  // The arguments must outlive this.
  Connections(const ServerOptions& options, telemetry::ServerMetrics& metrics);

  // Admits a peer. Returns null, or the last message to the peer if it is refused, because there are too many
  // peers or the server stops.
  delivery::SharedBytes admit(const std::shared_ptr<Peer>& peer);
  std::vector<std::shared_ptr<Peer>> peers() const;
  // Counts a connection of a subject while the result lives. Null if it has too many; identities that are not
  // verified are not counted. The result must not outlive this.
  std::shared_ptr<const void> count(const Identity& identity);
  // Announces that the server stops, and closes every peer, present and future.
  void close();

 private:
  const ServerOptions& options_;
  telemetry::ServerMetrics& metrics_;

  mutable std::mutex mutex_;  // protects all below
  std::vector<std::weak_ptr<Peer>> peers_;
  bool closed_ = false;
  std::map<scene::Subject, std::uint32_t> ofSubjects_;  // without zeros
};

}  // namespace clothstream::hosting
