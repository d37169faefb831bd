// SPDX-License-Identifier: MIT
// One peer of the server: serialised ClientMessages in, serialised ServerMessages out.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "server/delivery/envelope.h"
#include "server/hosting/peer.h"
#include "server/hosting/scene_server.h"
#include "server/identity/identity.h"
#include "server/messages/field_error.h"
#include "server/messages/limits.h"
#include "server/scene/roles.h"
#include "server/scene/roster.h"
#include "server/schedule/clock.h"
#include "server/schedule/token_bucket.h"
#include "server/session/peer_identity.h"
#include "server/session/rates.h"
#include "server/session/surface_upload.h"
#include "server/session/upload.h"

namespace clothstream::delivery {
class Mailbox;
}
namespace clothstream::messages {
struct Joining;
}
namespace clothstream::scene {
class LiveScene;
class RemoteSession;
}  // namespace clothstream::scene

namespace clothstream::session {

using schedule::Clock;
using schedule::TokenBucket;

// Largest serialised ClientMessage. Endpoints refuse larger ones before they allocate memory for them.
inline constexpr std::size_t kMaxClientMessageBytes = messages::limits::kMaxClientMessageBytes;

// Knowledge of an endpoint about a new peer.
struct Arrival {
  std::string peer;     // name for logs
  std::string address;  // groups the peers of one machine; empty for programs of this machine
  std::string token;    // sent with the connection; empty: none
  // Address of this machine that the connection has reached, such as 192.0.2.1; empty: not known.
  std::string reached = {};
  // The peer had a session with another server, which had the scene before. Its Hello must name a participant
  // of the scene. It gets no Welcome and no description, because it has both.
  bool continues = false;
  // The peer is connected to an edge, and not to this server.
  bool atEdge = false;
};

// Thread-safe. An endpoint opens one for each peer, feeds it what arrives, and writes what next() returns,
// one write in flight. When the write is done it calls next() again. If there is nothing it waits for `wake`.
//
// Datagrams of the peer, if it offers some and the server has a gate for them, also bring messages and take
// frames (hosting::DatagramGate).
//
// An invalid message is answered by an Error to this peer alone. Every refused message counts against a
// budget that refills with time; bytes that are not a message count as 60. A peer that exceeds the budget
// is disconnected.
class Session final : public hosting::Peer, public std::enable_shared_from_this<Session> {
 public:
  // Admits the peer to the server, or refuses it with a last message. `wake` is called, from any thread, when
  // next() may have something or finished() became true; it must not block. The server must outlive the
  // session.
  //
  // The session ends when the returned pointer is released. A peer that has not left is then disconnected:
  // its participant stays for the grace period. The release waits for a running `wake`, so the releasing
  // thread must hold no lock that `wake` takes. `wake` is not called after it.
  static std::shared_ptr<Session> open(hosting::SceneServer& server, Arrival arrival,
                                       std::function<void()> wake);

  // Handles one serialised ClientMessage. `sent`: time at which the peer sent it, if that is known. Limits of
  // messages per second count it, so that messages that were held up are not refused for coming together.
  void receive(std::span<const std::byte> message, Clock::time_point sent = Clock::now());
  // Time that the endpoint must wait before it reads the next message, because this peer sends more bytes a
  // second than Limits::maxReadRate. Usually 0.
  Clock::duration readPause() const { return readPause_.load(); }

  // The peer has said goodbye: it leaves the scene for good.
  void leave();
  // The peer's page was closed. It may have been reloaded, so its place is kept for ReconnectGrace::page.
  void closePage();

  // Returns the next message to write: control messages first, then the newest frame that the peer can decode
  // and has room for (see delivery::Mailbox).
  std::optional<delivery::SharedBytes> next();

  // Returns whether the peer must be closed once next() has nothing more: after a fatal error, when the
  // server stops, or when the peer does not read. The endpoint then bounds the time of the last writes (1 to
  // 2 s). The last message says why: a fatal Error, or a Notice that the server stops or the scene is
  // deleted.
  bool finished() const;

  // Returns whether the body of ClientMessage with this field number has a row in the table of messages.
  static bool handles(int body);

  void close(delivery::SharedBytes last) override;
  void checkSilence(Clock::time_point now) override;

 private:
  struct Messages;  // the table of messages and its handlers: requests.cpp

  Session(hosting::SceneServer& server, Arrival arrival, std::function<void()> wake);
  void end();
  std::shared_ptr<scene::RemoteSession> remote() const;
  // Decides on the identity of a peer that has sent none in a message.
  void identify(const std::string& token);

  // All following functions need the lock.
  // Checks and handles a message as its row in the table says.
  void dispatch(const v1::ClientMessage& message);
  void authenticate(const v1::AuthenticateRequest& request);
  void openDatagrams(const v1::DatagramOffer& message);
  // Sets the identity and counts the connection. Returns false, and ends the session, if there are too many.
  bool become(identity::Identity identity, const std::string& token);
  // Rights that the identity has in this scene.
  scene::Rights rightsIn(const scene::LiveScene& scene) const;
  void hello(const v1::Hello& message);
  // Opens a session with the server that simulates the scene, if there is one and the peer wants to take
  // part.
  bool joinRemotely(const v1::Hello& message, const messages::Joining& joining,
                    const std::shared_ptr<scene::LiveScene>& scene);
  // The scene that the peer asks for. Null, and the session has ended, if the peer may not join it.
  std::shared_ptr<scene::LiveScene> sceneOf(const v1::Hello& message, const messages::Joining& joining);
  void failToJoin(scene::Roster::Refusal refusal, const scene::LiveScene& scene);
  // `description` is the content id of the scene's description.
  void welcome(const scene::Roster::Admission& admission, const messages::Joining& joining,
               std::uint64_t description);
  // Sends what a peer that joins must know besides the description: pause, work, playback, recording.
  void tellPresentState(scene::LiveScene& scene);
  bool inLockstep() const;
  // What this peer may do with surfaces of its real room.
  v1::SurfaceLimits surfaceLimits() const;
  // Handles a part of the mesh of a surface.
  messages::Result<void> surfacePart(const messages::SurfaceUpdate& update, const v1::SurfacePart& message);
  // Returns a function that answers the current message when its result is known.
  template <typename Response>
  std::function<void(tl::expected<Response, v1::Error>)> answering(Response* (v1::ServerMessage::*body)());
  void answer(v1::ServerMessage& message);
  void refuse(const messages::FieldError& reason, double cost = 1);
  void refuseUnless(const messages::Result<void>& done);
  // For a request whose answer is made by answering().
  void refuseUnlessQueued(const tl::expected<void, v1::Error>& queued);
  // `server`: another one that has the scene.
  void fail(v1::ErrorCode code, std::string text, std::string server = {});
  TokenBucket& bucket(Rate rate) { return rates_[static_cast<std::size_t>(rate)]; }
  // Takes a token, or refuses the message.
  bool allowed(Rate rate, const char* what);
  bool isIn(const std::string& scene) const;
  // Returns whether this peer may do this to the scene of this name, from inside or outside.
  messages::Result<void> may(scene::Action action, const std::string& scene) const;
  enum class DisconnectReason : std::uint8_t { left, removed, lost, pageClosed };
  void disconnect(DisconnectReason reason);
  // Ends a connection that was too slow or silent.
  void cutOff(telemetry::Refusal reason, const std::string& text);
  void closeLocked(delivery::SharedBytes last, DisconnectReason reason);

  hosting::SceneServer& server_;
  const std::string peer_, address_;
  const bool continues_;
  const std::string reached_;
  const std::shared_ptr<delivery::Mailbox> mailbox_;
  const Clock::time_point opened_;
  std::atomic<Clock::time_point> lastHeard_;
  std::atomic<Clock::duration> readPause_{};

  mutable std::mutex remoteMutex_;  // protects `remote_`
  // Session with the server that simulates the scene, which gets all messages of this peer. Set once.
  std::shared_ptr<scene::RemoteSession> remote_;

  std::mutex mutex_;  // protects all below
  std::shared_ptr<scene::LiveScene> scene_;
  std::uint64_t participant_ = 0;
  PeerIdentity identity_;
  std::string whyUnknown_;                 // error for a peer without identity
  std::shared_ptr<const void> datagrams_;  // while the peer may exchange datagrams
  Upload upload_;
  SurfaceUpload surfaceUpload_;
  std::uint32_t asked_ = 0;  // requests whose answers another thread makes
  // Request id and arrival of the current message.
  std::uint64_t requestId_ = 0;
  Clock::time_point now_{};
  Clock::time_point sent_{};  // of the newest message; only grows

  std::array<TokenBucket, kFullBuckets.size()> rates_ = kFullBuckets;
  TokenBucket readRate_;  // bytes
};

}  // namespace clothstream::session
