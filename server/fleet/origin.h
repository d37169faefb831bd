// SPDX-License-Identifier: MIT
// Offers the scenes of this server to edge servers, and moves scenes between servers.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/fleet/directory.h"
#include "server/fleet/nats.h"
#include "server/fleet/origin_stream.h"
#include "server/fleet/origin_tunnels.h"
#include "server/hosting/scene_server.h"

namespace clothstream::fleet {

class Conversation;

struct OriginOptions {
  std::string publicName = {};  // under which clients reach the server; may be empty
  // Version of the program as in ServerEntry.
  std::uint32_t version = 0;
};

// It offers the default scene, scenes from files, created scenes and a recording that is played. It does not
// offer the other built-in scenes, which every server has, recordings in lockstep, and scenes whose name
// another server has in the directory.
//
// A scene that a client created moves while it runs: the other server loads it, this one stops it after a
// tick and sends its state, and the other one continues with the next tick. Edges and the participants there
// follow; whoever is connected to this server is told to join again. If anything fails, the scene stays here.
class Origin {
 public:
  // The server must outlive it.
  Origin(hosting::SceneServer& server, const NatsOptions& nats, OriginOptions options = {});
  // Tells the edges that the scenes have ended.
  ~Origin();
  Origin(const Origin&) = delete;
  Origin& operator=(const Origin&) = delete;

  std::uint64_t id() const { return id_; }
  const Directory& directory() const { return *directory_; }

  // Moves a scene to this server, or to the one with the most room. Waits until that is done.
  v1::MoveResponse move(const std::string& scene, std::uint64_t to = 0);
  // Takes no scenes any more, and moves the created ones away until this time. Returns the number of those
  // that stay.
  std::size_t moveAll(schedule::Clock::time_point until);
  // Says nothing more to other servers, as if this one were killed. For tests.
  void simulateLoss();

 private:
  using Clock = schedule::Clock;
  using SharedStream = std::shared_ptr<OriginStream>;
  class Worker;

  void run();
  void endOffers();
  // Begins and ends streams, as scenes are created and deleted.
  void lookForScenes();
  void offer();
  // Removes a scene that another server has. `server` is its public name, or empty.
  void remove(const std::shared_ptr<scene::LiveScene>& scene, const std::string& server);
  void hear(std::span<const std::byte> request, const std::string& reply);
  // The other server with the most room for this scene; 0 if there is none.
  std::uint64_t target(const scene::LiveScene& scene) const;
  // Gives the scene up to another server only if that has loaded it by this time.
  v1::MoveResponse moveBy(Clock::time_point until, const std::string& scene, std::uint64_t to);
  // An exception becomes an error of the response.
  v1::MoveResponse moveNow(const std::string& name, std::uint64_t to, Clock::time_point until);
  v1::MoveResponse tryMove(const std::string& name, std::uint64_t to, Clock::time_point until);
  // `move` is the number of the move in which both servers talk.
  v1::MoveResponse moveTo(Conversation& talk, std::uint64_t move, const v1::ServerEntry& other,
                          const SharedStream& stream, Clock::time_point until);
  // Next message of another server; nothing if none comes by this time, or if that server is gone.
  std::optional<v1::MoveMessage> receive(Conversation& talk, std::uint64_t other, Clock::time_point until);
  // Sends the state of a scene that is held, and waits until the other server has it. Returns why it stays.
  std::string handOver(Conversation& talk, const OriginStream& stream, std::uint64_t to,
                       Clock::time_point& stopped);
  void receiveScene(std::uint64_t move);
  // Makes a scene this server's in the directory. Returns false if it belongs to another one.
  bool takes(const v1::SceneEntry& entry, const std::string& name, std::uint64_t revision);
  // Lets a scene of another server begin here.
  SharedStream prepareStream(const std::shared_ptr<scene::LiveScene>& scene, std::uint64_t continues);
  void runStream(const SharedStream& stream);
  void dropStream(const SharedStream& stream);
  std::string adopt(v1::SavedParts parts, const std::function<bool()>& claim);
  SharedStream streamOf(const std::string& name) const;

  hosting::SceneServer& server_;
  const std::uint64_t id_;
  const OriginOptions options_;
  Nats nats_;
  OriginTunnels tunnels_;

  std::atomic<bool> stopping_{false};
  // Other servers are not waited for beyond this time.
  std::atomic<Clock::time_point> waitsUntil_{Clock::time_point::max()};
  std::mutex looking_;        // held by lookForScenes()
  mutable std::mutex mutex_;  // protects the next three
  std::condition_variable changed_;
  std::map<std::string, SharedStream> streams_;   // by name of the scene
  std::map<std::string, SharedStream> prepared_;  // the same, until they run

  std::unique_ptr<Worker> departures_, arrivals_;
  std::unique_ptr<Directory> directory_;
  std::unique_ptr<Nats::Subscription> requests_;
  std::thread thread_;
};

}  // namespace clothstream::fleet
