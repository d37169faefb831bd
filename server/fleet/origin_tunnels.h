// SPDX-License-Identifier: MIT
// Participants on edges, as sessions of the server that simulates their scenes.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/nats.h"
#include "server/fleet/subjects.h"
#include "server/hosting/scene_server.h"

namespace clothstream::fleet {

// Each participant has a session like one that is connected to this server, with the same limits.
// Thread-safe.
class OriginTunnels {
 public:
  OriginTunnels(hosting::SceneServer& server, Nats& nats);
  // Ends all sessions. No subscription may call receive() any more.
  ~OriginTunnels();
  OriginTunnels(const OriginTunnels&) = delete;
  OriginTunnels& operator=(const OriginTunnels&) = delete;

  // Handles a segment of the stream. Call it from one thread.
  void receive(const std::string& stream, const std::string& subject, std::span<const std::byte> bytes);
  // The stream ends, or its scene has left this server: its sessions end without a further message.
  void end(const std::string& stream);
  // Waits until the edges have the last messages of sessions that have ended, but at most a second.
  void deliverEnds() const;

  // For a scene that moves. After freeze() the sessions of the stream use no message any more; the result
  // says which ones they have used. thaw() ends that.
  std::vector<v1::MovedTunnel> freeze(const std::string& stream);
  void thaw(const std::string& stream);
  // Tunnels of the former server that will continue at this stream.
  void expect(const std::string& stream, const std::vector<v1::MovedTunnel>& tunnels);

 private:
  struct Tunnel;
  using Key = std::pair<std::string, TunnelId>;  // stream

  void run();
  void wake(const Key& key);
  std::shared_ptr<Tunnel> find(const Key& key) const;
  std::shared_ptr<Tunnel> open(const Key& key, const v1::OpenTunnel& request);
  // Sends what the session and the channel have. Returns false once the tunnel has ended.
  bool pump(Tunnel& tunnel);
  std::vector<std::shared_ptr<Tunnel>> all() const;
  std::vector<std::shared_ptr<Tunnel>> of(const std::string& stream) const;

  hosting::SceneServer& server_;
  Nats& nats_;

  mutable std::mutex mutex_;  // protects all below
  std::condition_variable changed_;
  std::map<Key, std::shared_ptr<Tunnel>> tunnels_;
  std::map<Key, std::uint64_t> expected_;  // newest used segments of tunnels that will continue here
  std::deque<Key> woken_;
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace clothstream::fleet
