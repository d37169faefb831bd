// SPDX-License-Identifier: MIT
// What a server knows of its fleet: which servers are there, and which of them has which scene.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "server/schedule/clock.h"

namespace clothstream::fleet {

// Key of the entry of a server.
std::string keyOf(std::uint64_t origin);

// Entries of servers and scenes, as changes of the buckets tell them. A server is alive while its lease
// lasts. This one's renewals come back too: without them no server counts as gone. Not thread-safe.
class FleetView {
 public:
  using Clock = schedule::Clock;
  static constexpr std::chrono::seconds kLease{5};

  struct Server {
    v1::ServerEntry entry;
    Clock::time_point renewed{};
    bool isNew = false;  // heard of after the present entries were read
  };
  struct Scene {
    v1::SceneEntry entry;
    std::uint64_t revision = 0;
  };

  explicit FleetView(std::uint64_t self) : self_(self) {}

  // The present entries are read again.
  void beginReading() { readAt_ = {}; }
  // All present scenes are read: others are gone.
  void finishReading(const std::set<std::string>& present, Clock::time_point now);
  // Whether the newest round has read the changes.
  void setReads(bool reads) { reads_ = reads; }

  void renew(const v1::ServerEntry& entry, bool isNew, Clock::time_point now);
  void removeServer(const std::string& key);
  // Remembers an entry, unless a newer one is known.
  void learn(const std::string& scene, const v1::SceneEntry& entry, std::uint64_t revision);
  // Remembers an entry also after NATS has lost everything, and counts from 1 again.
  void replace(const std::string& scene, const v1::SceneEntry& entry, std::uint64_t revision);
  // A newer entry stays.
  void removeScene(const std::string& scene, std::uint64_t revision);

  const std::map<std::string, Scene>& scenes() const { return scenes_; }
  // Null if it is not known.
  const Scene* find(const std::string& scene) const;
  // Null if it has never been heard of.
  const Server* server(std::uint64_t origin) const;
  // Revision of the entry of a scene that this server has.
  std::optional<std::uint64_t> ownRevisionOf(const std::string& scene) const;

  // Whether the server has a lease. While this one cannot hear of renewals, every known server has one.
  bool isAlive(std::uint64_t origin, Clock::time_point now) const;
  // Other servers with a lease.
  std::vector<v1::ServerEntry> others(Clock::time_point now) const;
  // Whether the present entries have been known for a lease, so that servers without one are gone. Ask after
  // finishReading().
  bool isSettled(Clock::time_point now) const { return now - readAt_ >= kLease; }
  // Whether the renewals of this server have not come back for so long that changes do not come any more.
  bool isSilent(Clock::time_point now) const;

 private:
  // Whether this server has heard of renewals for long enough to know which servers are gone.
  bool hears(Clock::time_point now) const;

  const std::uint64_t self_;
  std::map<std::uint64_t, Server> servers_;
  std::map<std::string, Scene> scenes_;
  bool reads_ = false;
  Clock::time_point readAt_{};  // all present entries are known since
};

}  // namespace clothstream::fleet
