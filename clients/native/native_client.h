// SPDX-License-Identifier: MIT
// Native client: clients/core, a transport, and a thread that serves both.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/native/address.h"
#include "clients/native/failure.h"
#include "clients/native/stream_log.h"
#include "clients/native/transport.h"

namespace clothstream {

struct NativeClientOptions {
  std::string scene;  // empty: the server's default scene
  std::string clientName = "clothstream";
  std::string displayName;  // name that others see; may be empty
  cs_role role = CS_ROLE_UNSPECIFIED;
  std::uint32_t quality = 0;  // finest quality that the client requests, as in cs_want
  // Vertices that the client accepts from the server; twice as many triangles (cs_set_limits). 0 means the
  // defaults of cs_limits. At most 67,108,864.
  std::uint32_t maxVertices = 0;
  // Longest time from the call of join() to the complete description.
  std::chrono::milliseconds joinTimeout{10'000};
  // Called ten times a second while joining; true cancels. May be empty.
  std::function<bool()> cancelled;
  // Receives every message before the cs_client does, on the client's thread. May be empty.
  std::function<void(std::span<const std::byte>)> onMessage;
  // Receives the log, on the client's thread. May be empty.
  OnLog onLog;
  // Time for which a joined client tries to reconnect. 0: the stream ends with the connection.
  std::chrono::milliseconds reconnectFor{60'000};
  // In lockstep, a frame is acknowledged when the program has seen it: with the call of wait() after the one
  // that reported it, or, in a program that never calls wait(), with unlock(). Otherwise each frame is
  // acknowledged after onEvents.
  bool acknowledgesSeen = false;
  // The connection counts as lost after this time without a message. The server answers pings twice a second.
  // While the client reconnects, the shorter times of clients/core apply.
  std::chrono::milliseconds silenceTimeout{10'000};
};

// Owns a cs_client and a thread that transfers its messages. Thread-safe.
class NativeClient {
 public:
  // Called on that thread after each message that changed something, with the event bits of cs_receive, also
  // before join() returns. The bits are 0 when the connection is lost or an attempt to reconnect has failed.
  // Must not call the NativeClient.
  using OnEvents = std::function<void(cs_client*, std::uint32_t events)>;

  // `transport` must lead to `address`, which must come from completeAddress(). Returns when the description
  // is complete. If the server names another one that has the scene, the client connects there, with the same
  // scheme and port (cs_connect_server in core.h): while it joins, and later unless reconnectFor is 0. It
  // does not if it has a token and the address has no TLS.
  [[nodiscard]] static tl::expected<std::unique_ptr<NativeClient>, Failure> join(
      const ServerAddress& address, std::unique_ptr<Transport> transport, const NativeClientOptions& options,
      OnEvents onEvents);
  // Leaves the scene if the stream has not ended. Waits at most 0.5 s for the server.
  ~NativeClient();
  NativeClient(const NativeClient&) = delete;
  NativeClient& operator=(const NativeClient&) = delete;

  // Gives the caller exclusive access until unlock(), which the same thread must call soon. Meanwhile no
  // message is received; new messages are sent after unlock(). Also works after the end of the stream.
  cs_client* lock();
  void unlock();
  // Calls `task` between lock() and unlock().
  void visit(const std::function<void(cs_client*)>& task);

  // Waits until something has changed since the last call, the stream has ended, or the timeout is over.
  // Returns the event bits of all messages since the last call.
  std::uint32_t wait(std::chrono::milliseconds timeout);

  // Figures of the datagrams, as of the last message or the last 50 ms; nothing if there were none. Also
  // allowed between lock() and unlock().
  std::optional<cs_datagram_statistics> datagrams() const;

  // Reason why the stream ended, or nothing while it runs.
  std::optional<Failure> ended() const;

  // Clock of the cs_client, microseconds.
  static std::uint64_t nowUs();

 private:
  class Stream;
  explicit NativeClient(std::unique_ptr<Stream> stream);
  std::unique_ptr<Stream> stream_;
};

}  // namespace clothstream
