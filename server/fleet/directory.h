// SPDX-License-Identifier: MIT
// Which server of a fleet has which scene, in NATS' key-value store.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/bucket.h"
#include "server/fleet/fleet_view.h"
#include "server/fleet/orphans.h"
#include "server/fleet/own_names.h"
#include "server/hosting/scene_server.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {
class LiveScene;
}

namespace clothstream::fleet {

// A server has a lease, which it renews twice a second. A scene belongs to the server in its entry as long as
// that server's lease lasts; then another server takes its name over or, for a scene that a client created,
// continues it from its newest checkpoint. Thread-safe; its threads wait for NATS.
//
// Without JetStream there is no directory, and edges choose between scenes of the same name.
class Directory {
 public:
  // Interval of the checkpoints of created scenes.
  static constexpr std::chrono::seconds kCheckpointPeriod{3};
  static constexpr const char *kServers = "clothstream-servers", *kScenes = "clothstream-scenes",
                              *kCheckpoints = "clothstream-checkpoints";

  // A scene of this server.
  struct OwnScene {
    std::shared_ptr<scene::LiveScene> scene;
    std::uint64_t stream = 0;
  };
  // Continues a scene of a server that is gone. `claim` makes it this server's, at once before it runs.
  // Returns why not; empty if it runs.
  using Adopt = std::function<std::string(v1::SavedParts parts, const std::function<bool()>& claim)>;

  // `self`: the entry of this server, whose numbers are read from the server. References must outlive it.
  Directory(Nats& nats, hosting::SceneServer& server, v1::ServerEntry self, Adopt adopt);
  ~Directory();
  // Writes the last checkpoints, ends the lease, and does nothing more.
  void end();
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;

  // Scenes that this server has and offers now. Those that are not in the list any more are given up.
  void setScenes(std::vector<OwnScene> scenes);
  // Whether another server has a scene of this name, so that this one must not offer its own. While a scene
  // moves it is not.
  bool isTaken(const std::string& name) const;
  // Whether isTaken(), and the other server has been heard of since this one began to listen.
  bool isRunElsewhere(const std::string& name) const;
  // Whether the entry of this scene names this server.
  bool owns(const std::string& name) const;
  // Name under which clients reach the other server that has a scene; empty if it has none, or if the scene's
  // server is gone and another one is about to continue it. Nothing if this one has it, or none.
  std::optional<std::string> publicNameOf(const std::string& scene) const;
  // Other servers with a lease.
  std::vector<v1::ServerEntry> others() const;
  bool isThere(std::uint64_t other) const;
  // This server takes no scenes any more.
  void setStopping();
  bool isStopping() const;
  // Begins a move of a scene that this server has: its entry does not change until endMove(). Returns the
  // revision of the entry, or nothing if it has none.
  std::optional<std::uint64_t> beginMove(const std::string& name);
  void endMove(const std::string& name);
  // A scene of this name comes to this server. Its entry may be this server's before setScenes() has it.
  void expect(const std::string& name);
  void expectNoMore(const std::string& name);
  // Newest checkpoint of a scene of any server.
  v1::StoredCheckpoint checkpointOf(const std::string& name) const;
  // Writes the entry of a scene, unless its revision is another one. Returns whether it is written. The
  // following three may be called on any thread, and throw what Bucket throws.
  bool transfer(const std::string& name, const v1::SceneEntry& entry, std::uint64_t revision);
  // Server that has a scene, 0 if none; and transfer() whatever the revision is.
  std::uint64_t ownerOf(const std::string& name);
  void give(const std::string& name, const v1::SceneEntry& entry);
  // Ends all work at once, as if the server were killed. For tests.
  void simulateLoss();

 private:
  using Clock = schedule::Clock;
  struct Buckets;
  struct Stored {
    Clock::time_point at{};
    // Newest saved state.
    std::uint64_t tick = 0, version = 0;
    std::uint32_t session = 0;  // CRC
    bool operator==(const Stored&) const = default;
  };

  void run();
  // Renews the lease on another thread, because a round may take longer than the lease.
  void renew();
  v1::ServerEntry selfNow() const;
  // One round: reads changes, claims and gives up scenes, saves and adopts.
  void pass(Buckets& buckets);
  void readChanges(Buckets& buckets);
  // Throws std::runtime_error if the renewals of this server have not come back for some time.
  void checkHearing();
  void endLease();
  void claimScenes(Buckets& buckets, const std::vector<OwnScene>& scenes);
  void saveScenes(Buckets& buckets, const std::vector<OwnScene>& scenes, bool all);
  bool save(Buckets& buckets, const OwnScene& own);
  void adoptScenes(Buckets& buckets);
  std::optional<v1::SavedParts> load(Buckets& buckets, const std::string& name,
                                     const v1::StoredCheckpoint& stored);
  // Remembers an entry, unless a newer one is known.
  void know(const std::string& name, const v1::SceneEntry& entry, std::uint64_t revision);
  bool isTakenLocked(const std::string& name) const;
  std::vector<OwnScene> scenesNow() const;

  Nats& nats_;
  hosting::SceneServer& server_;
  const v1::ServerEntry self_;
  const Adopt adopt_;

  mutable std::mutex mutex_;  // protects the following
  std::condition_variable changed_;
  std::vector<OwnScene> scenes_;
  OwnNames own_;
  FleetView view_;
  Orphans orphans_;
  std::string saving_;  // scene whose entry the thread is about to change
  bool leaves_ = false, stopping_ = false, lost_ = false, leaseEnds_ = false;

  // Used by the thread.
  std::map<std::string, Stored> saved_;
  bool logged_ = false;  // that there is no directory

  std::thread thread_, renewing_;
};

}  // namespace clothstream::fleet
