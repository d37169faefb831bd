// SPDX-License-Identifier: MIT
// Interface between a native client and a network protocol: one connection at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "clients/core/core.h"
#include "clients/native/failure.h"

namespace clothstream {

// Largest message that a client reads: enough for a key frame of the largest scene. A description travels in
// small chunks.
inline constexpr std::size_t kMaxServerMessageBytes = std::size_t{256} << 20;
// Time that the server has to end a connection after the client has left.
inline constexpr std::chrono::milliseconds kClosingTime{500};

// All functions except wake() belong to one thread.
class Transport {
 public:
  virtual ~Transport() = default;

  // Starts to open a connection to the address of the transport. Only while none is active. `server`: DNS
  // name in place of the host of that address; empty: the address as it is. With TLS, the certificate is
  // checked against this name.
  virtual void connect(const std::string& server) = 0;
  // Starts to open a connection for a later connect() with this name. Failures are not reported: connect()
  // then opens another one.
  virtual void prepare(const std::string& server) = 0;
  // Whether the connection is opening, open or closing. False before the first connect().
  virtual bool active() const = 0;
  // Whether the newest connection has opened. Stays true after its end.
  virtual bool hasOpened() const = 0;
  // Whether write() is allowed: the connection is open, and the last message is written.
  virtual bool canWrite() const = 0;
  // Starts to write a message. The bytes are copied.
  virtual void write(std::span<const std::byte> message) = 0;
  // Says goodbye as soon as canWrite(). Call it until the connection is not active any more.
  virtual void leave() = 0;
  // Ends the connection without a goodbye. It may stay active until the next wait().
  virtual void cancel() = 0;

  // Address that the open connection has reached, such as 192.0.2.1 or 2001:db8::1; empty: not known.
  virtual std::string serverAddress() const { return {}; }
  // Called before each write(), on the thread of the client: a transport may talk to the server through it.
  virtual void negotiate(cs_client& /*client*/) {}
  // Requirement of the transport that a client with an open connection waits for before it counts as joined.
  struct Missing {
    std::string text;      // for users
    bool isFinal = false;  // it will not come
  };
  virtual std::optional<Missing> missing() const { return std::nullopt; }
  // Sum over all connections; nothing if no datagrams were open so far.
  virtual std::optional<cs_datagram_statistics> datagrams() const { return std::nullopt; }

  // Waits until something has happened, wake() is called, or the time is over.
  virtual void wait(std::chrono::steady_clock::duration atMost) = 0;
  // Returns the message that wait() has received, if any, and reads the next one. The bytes are valid until
  // the next wait().
  virtual std::optional<std::span<const std::byte>> receive() = 0;
  // Ends a wait(), or the next one. Thread-safe.
  virtual void wake() = 0;

  // About a connection that is over: whether the server has ended it properly, and the failure of a client
  // that had not yet received a message, or had.
  virtual bool endedByServer() const = 0;
  virtual Failure notJoined() const = 0;
  virtual Failure lost() const = 0;
};

}  // namespace clothstream
