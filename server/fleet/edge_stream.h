// SPDX-License-Identifier: MIT
// One stream of an origin on an edge.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "proto/codec/packet_header.h"
#include "server/fleet/description_download.h"
#include "server/fleet/edge_source.h"
#include "server/fleet/edge_tunnel.h"
#include "server/fleet/interest_times.h"
#include "server/fleet/nats.h"
#include "server/hosting/scene_server.h"
#include "server/schedule/clock.h"

namespace clothstream::fleet {

// Parts of an edge that its streams use. References must outlive the streams.
struct EdgeContext {
  Nats& nats;
  hosting::SceneServer& server;
  std::uint64_t edge = 0;
  std::function<void()> wake;  // look at the streams soon
  // Hands a piece of the description of this stream to the edge's thread.
  std::function<void(std::uint64_t stream, std::span<const std::byte> bytes)> arrive;
};

// First its description is received, then it is served. Belongs to the edge's thread; messages arrive on
// another one.
class EdgeStream {
 public:
  EdgeStream(EdgeContext context, std::uint64_t origin, const v1::OfferedScene& offered);
  // A stream that continues another one, because the scene moves to its origin. Viewers get whatever comes
  // first of both, until replace().
  EdgeStream(EdgeContext context, std::uint64_t origin, const v1::OfferedScene& offered,
             const EdgeStream& former);
  EdgeStream(const EdgeStream&) = delete;
  EdgeStream& operator=(const EdgeStream&) = delete;

  std::uint64_t id() const { return offered_.stream(); }
  std::uint64_t origin() const { return origin_; }
  // Null until it is served.
  const std::shared_ptr<scene::LiveScene>& scene() const { return scene_; }

  // Whether its first description is under way.
  bool isLoading() const { return !scene_ && chunks_ != nullptr; }
  // Returns true when the description is complete.
  bool receiveChunk(std::span<const std::byte> bytes, schedule::Clock::time_point now);
  // Begins to serve the stream, or takes parameters from the description after refresh(). Returns false if
  // the stream cannot be shown.
  bool serve();
  // Ends it, with this as the last message to everyone in the scene.
  void end(const delivery::SharedBytes& last);

  // Asks the origin for what is needed. Call it every 20 ms or so.
  void look(schedule::Clock::time_point now);
  // Takes what a later offer says.
  void learn(const v1::OfferedScene& offered);
  // NATS was away: frames and events may be missing.
  void refresh(schedule::Clock::time_point now);
  // Everyone in the scene reads why the picture stands still.
  void tell(const char* why);

  // Whether it continues another stream and has not replaced it yet.
  bool isSuccessor() const { return continues_ && !replaced_; }
  // Whether a frame has come.
  bool arrived() const { return arrived_; }
  // Replaces the stream that it continues. Participants follow.
  void replace();
  // Another stream has replaced it.
  void retire();

 private:
  using Clock = schedule::Clock;
  struct Frames {
    Clock::time_point neededAt{};
    std::unique_ptr<Nats::Subscription> subscription;
  };

  void listen();
  void askForDescription(Clock::time_point now);
  void ask(Clock::time_point now);
  // Tells the origin what is needed, if it is time to do so.
  void tellInterest(const delivery::RequestedFrames& needed, bool asksOften, Clock::time_point now);
  void receiveFrames(std::uint8_t qualities, Clock::time_point now);
  void receiveFrame(std::span<const std::byte> data);
  void event(std::span<const std::byte> data);
  void receive(std::span<const std::byte> data);

  const std::uint64_t origin_;
  const EdgeContext edge_;
  const v1::OfferedScene offered_;
  const std::string name_, subject_, inbox_;
  const bool continues_ = false;

  DescriptionDownload description_;
  InterestTimes interest_;
  std::shared_ptr<scene::LiveScene> scene_;  // once it is served

  bool pauseIsOld_ = false;  // until the next offer

  std::mutex mutex_;  // protects the next three for events, which may come before serve()
  std::shared_ptr<EdgeSource> source_;
  bool refreshes_ = false;
  std::deque<delivery::SharedBytes> early_;

  const std::shared_ptr<EdgeTunnels> tunnels_;
  std::atomic<bool> arrived_{false}, replaced_{false};

  std::unique_ptr<Nats::Subscription> events_, down_, chunks_;
  std::array<Frames, codec::kMaxQualities> frames_;
};

}  // namespace clothstream::fleet
