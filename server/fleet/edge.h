// SPDX-License-Identifier: MIT
// Scenes of other servers, which this server shows to its viewers.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "server/fleet/edge_stream.h"
#include "server/fleet/nats.h"
#include "server/hosting/scene_server.h"
#include "server/schedule/clock.h"

namespace clothstream::v1 {
class Offer;
class OfferedScene;
}  // namespace clothstream::v1

namespace clothstream::fleet {

// Adds the scenes that origins offer to a server without scenes of its own, and asks the origins for the
// frames that the viewers need. If two origins offer scenes of the same name, the first one counts as long as
// it is offered.
//
// Without NATS or without the origin of a scene, its viewers stay and read why the picture stands still. They
// go on with a key frame when both are back. An origin that has started again has another stream: viewers are
// then disconnected once and join again. A scene whose origin does not come back is removed after `keep`.
class Edge {
 public:
  static constexpr std::chrono::seconds kPatience{3}, kLongestWait{10};
  static constexpr std::size_t kMaxScenes = 4096;

  // The server must outlive it.
  Edge(hosting::SceneServer& server, const NatsOptions& options, schedule::Clock::duration keep);
  ~Edge();
  // Returns when all origins have had time to offer their scenes and those are served, after kPatience
  // without any, or after kLongestWait.
  void waitForOffers() const;
  Edge(const Edge&) = delete;
  Edge& operator=(const Edge&) = delete;

 private:
  using Clock = schedule::Clock;
  struct Known;
  struct Arrival {
    std::uint64_t stream = 0;  // 0: an offer
    delivery::SharedBytes bytes;
  };

  void run();
  EdgeContext context();
  void arrive(std::uint64_t stream, std::span<const std::byte> bytes);
  void wake();
  void receiveChunk(Known& known, const Arrival& arrival, Clock::time_point now);
  void handle(const v1::Offer& offer, Clock::time_point now);
  void handle(std::uint64_t origin, const v1::OfferedScene& offered, Clock::time_point now);
  // Serves the stream of the server that a scene has moved to. Its viewers notice nothing.
  void replace(Known& known);
  // Serves a stream whose description is complete, instead of the former one.
  void serve(Known& known);
  // Asks origins for what is needed, and looks for lost ones.
  void look(Clock::time_point now);
  bool lookAt(const std::string& name, Known& known, Clock::time_point now);

  hosting::SceneServer& server_;
  const std::uint64_t id_;
  const Clock::duration keep_;
  Nats nats_;

  // Used by the thread.
  std::map<std::string, std::unique_ptr<Known>> scenes_;  // by name
  std::optional<Clock::time_point> connectedSince_;

  std::atomic<bool> loads_{false};  // a scene that is offered is not served yet

  std::mutex mutex_;  // protects the next three
  std::condition_variable changed_;
  std::deque<Arrival> arrivals_;
  bool woken_ = false, stopping_ = false;

  std::unique_ptr<Nats::Subscription> offers_;
  std::thread thread_;
};

}  // namespace clothstream::fleet
