// SPDX-License-Identifier: MIT
// Session of a participant on an edge with the origin of the scene.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/fleet/channel.h"
#include "server/fleet/nats.h"
#include "server/fleet/relayed_messages.h"
#include "server/fleet/subjects.h"
#include "server/scene/remote_session.h"

namespace clothstream::fleet {

// Resume tokens that the origin did not know while its scene was full, for a few seconds. Thread-safe.
class Strangers {
 public:
  void add(std::string resumeToken);
  bool contains(const std::string& resumeToken) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, schedule::Clock::time_point> until_;
};

// All bytes of the peer go through NATS, both ways, as they are. Datagrams end here: their input goes the
// same way, and frames leave in them. Thread-safe.
//
// While nothing comes from the origin, pings are answered here, with its clock as it was last seen. A client
// that waits for NATS thus stays connected.
//
// When the scene moves to another server, the tunnel continues there: what the former server has not used is
// sent to the new one, and the peer notices nothing.
class EdgeTunnel final : public scene::RemoteSession {
 public:
  // Bytes of messages of the peer that wait for the origin.
  static constexpr std::size_t kMaxWaiting = std::size_t{4} << 20;

  EdgeTunnel(Nats& nats, std::string stream, const TunnelId& id, const scene::RemotePeer& peer,
             std::shared_ptr<Strangers> strangers, std::function<void()> wake);
  ~EdgeTunnel() override;

  [[nodiscard]] bool send(std::span<const std::byte> message) override;
  std::optional<delivery::SharedBytes> next() override;
  bool ended() const override;
  void end(End how) override;
  void setLink(std::optional<Link> link) override;
  void setFrameWake(std::function<void()> wake) override;
  std::optional<delivery::SharedBytes> nextFrame(schedule::Clock::time_point now) override;
  // The origin chooses the quality by the acknowledgements of the peer.
  bool wantsFinerQuality() const override { return false; }

  const TunnelId& id() const { return id_; }
  // From the origin. `stream` is the one that it comes from.
  void receive(const std::string& stream, const v1::Segment& segment);
  // Sends what is due. Call it every 20 ms or so. Returns false once there is nothing more to do.
  bool poll();
  // Continues at this stream.
  void moveTo(std::string stream);
  // Ends it with this last message to the peer, or without one.
  void close(const delivery::SharedBytes& last);
  // Gives the peer a message.
  void tell(delivery::SharedBytes message);

 private:
  void pollLocked();
  // Answers a ping if the origin cannot. Returns false for other messages.
  bool answerPing(std::span<const std::byte> message, schedule::Clock::time_point now);
  void pushLocked(std::span<const std::byte> message);
  // Something has left: the origin may send more.
  void noteTaken();
  // Both remember what another server needs to know the participant. readRequest() reads acknowledgements,
  // too.
  void readRequest(std::span<const std::byte> message);
  void readAnswer(const delivery::SharedBytes& message);

  Nats& nats_;
  const TunnelId id_;
  const std::shared_ptr<Strangers> strangers_;
  const std::function<void()> wake_;

  mutable std::mutex mutex_;  // protects all below
  std::string stream_;
  v1::OpenTunnel open_;
  v1::Hello hello_;
  bool welcomed_ = false;
  // Renewed token of the peer that the origin has not accepted yet, and the request that has it.
  std::string token_;
  std::uint64_t tokenRequest_ = 0;
  Channel channel_;
  bool known_ = false;  // the origin may have heard of the peer
  RelayedMessages messages_;
  std::function<void()> frameWake_;
  schedule::Clock::time_point heardAt_{};        // newest segment
  schedule::Clock::time_point keyFrameAsked_{};  // by this edge
  std::optional<std::int64_t> serverAheadUs_;    // clock of the origin, in its newest Pong
  bool closed_ = false;                          // no message will follow
  bool left_ = false;                            // the peer is gone
};

// Tunnels of one scene on an edge. Thread-safe.
class EdgeTunnels {
 public:
  EdgeTunnels(Nats& nats, std::uint64_t edge, std::string stream)
      : nats_(nats), edge_(edge), stream_(std::move(stream)) {}

  // Null if the scene has no room for another participant, unless the peer may have a place in it. After
  // close(), the session has only the last message.
  std::shared_ptr<scene::RemoteSession> connect(const scene::RemotePeer& peer, std::function<void()> wake);
  // Whether the scene has room for participants, as its origin says.
  void setRoom(bool hasRoom) { hasRoom_ = hasRoom; }
  void receive(const std::string& stream, const std::string& subject, std::span<const std::byte> bytes);
  void poll();
  // As for one tunnel.
  void moveTo(const std::string& stream);
  void close(const delivery::SharedBytes& last);
  void tell(const delivery::SharedBytes& message);

 private:
  std::vector<std::shared_ptr<EdgeTunnel>> all() const;

  Nats& nats_;
  const std::uint64_t edge_;
  const std::shared_ptr<Strangers> strangers_ = std::make_shared<Strangers>();
  std::atomic<bool> hasRoom_{false};

  mutable std::mutex mutex_;  // protects all below
  std::string stream_;
  std::optional<delivery::SharedBytes> last_;                     // of close()
  std::map<std::uint64_t, std::shared_ptr<EdgeTunnel>> tunnels_;  // by peer
};

}  // namespace clothstream::fleet
