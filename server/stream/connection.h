// SPDX-License-Identifier: MIT
// One peer of the server, whichever endpoint it came through: serialised ClientMessages in, serialised
// ServerMessages out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "server/messages/limits.h"
#include "server/stream/envelope.h"

namespace clothstream::stream {

class SceneServer;
class Session;

// Largest serialised ClientMessage; endpoints refuse larger ones before they hold them.
inline constexpr std::size_t kMaxClientMessageBytes = messages::limits::kMaxClientMessageBytes;

// Thread-safe. A endpoint makes one for each peer, feeds it what arrives, and writes what next() gives, one
// write in flight: when the write is done it asks again; when there is nothing it waits for `wake`.
class Connection {
 public:
  // `wake` is called, from any thread, when next() may have something or finished() became true; it must only
  // pass the word on. `peer` names the other end for logs. The server must outlive the connection.
  Connection(SceneServer& server, std::string peer, std::function<void()> wake);
  // The peer is cut off, unless it has left: its participant is held for a while. `wake` is not called any
  // more once this returns (so hold no lock here that `wake` takes).
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // One ClientMessage. Whatever is wrong with it is answered by an Error to this peer alone.
  void receive(std::span<const std::byte> message);

  // The peer said, in its endpoint's way, that it has no more to say: it leaves the scene for good.
  void leave();

  // The next message to write: control first, then the newest frame that this peer can decode and has room
  // for (at most two unacknowledged, more on long round trips).
  std::optional<SharedBytes> next();

  // The peer is to be closed (after a fatal error, or when the server stops), once next() has nothing more. A
  // peer that does not read is finished too: a endpoint gives its last writes a second or so, then cuts. The
  // last message says why: a fatal Error, or the Notice that the server stops.
  bool finished() const;

 private:
  std::shared_ptr<Session> session_;
};

}  // namespace clothstream::stream
