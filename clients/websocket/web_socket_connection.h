// SPDX-License-Identifier: MIT
// One WebSocket connection to the web endpoint of a server, with or without TLS.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "clients/native/address.h"

namespace boost::asio {
class io_context;
}

namespace clothstream {

// Why a connection has ended.
struct WebSocketEnd {
  // Step that was under way.
  enum class Stage { lookup, connect, tls, upgrade, open };
  Stage stage = Stage::lookup;
  std::string why;         // from the network, from TLS, or the text of the server
  bool byServer = false;   // open: a close frame, not a broken connection
  bool untrusted = false;  // tls: the certificate was refused
  std::string shownKey;    // tls: fingerprint of the server's key, if it has shown one
  int httpStatus = 0;      // upgrade: the answer, if there was one
  bool isOurs = false;     // upgrade: the answer came from a clothstream-server
};

// Receives the events of a connection, on the thread of its io_context.
class WebSocketListener {
 public:
  virtual void opened() = 0;
  // One message after a call of read(). The bytes are valid until the next one arrives.
  virtual void received(std::span<const std::byte> message) = 0;
  virtual void written() = 0;
  // The last call. The connection may be destroyed after it.
  virtual void ended(const WebSocketEnd& end) = 0;

 protected:
  ~WebSocketListener() = default;
};

// Belongs to the thread of its io_context. Before its destruction it must have ended, or the io_context must
// run no more.
class WebSocketConnection {
 public:
  virtual ~WebSocketConnection() = default;
  // Reads one message. Allowed after opened(), and again after received().
  virtual void read() = 0;
  // Allowed after opened(), and again after written().
  virtual void write(std::string message) = 0;
  // Says goodbye with a close frame. Must not be called while a message is being written, or twice.
  virtual void close() = 0;
  // Ends the connection without a goodbye. ended() follows.
  virtual void cancel() = 0;
  // As Transport::serverAddress().
  virtual std::string serverAddress() const { return {}; }
};

// Shared by the connections to one server: its address, whom to trust, the lookup of its name.
class WebSocketConnector {
 public:
  // `io` must outlive the connector. Throws std::invalid_argument if the file of authorities cannot be read.
  WebSocketConnector(boost::asio::io_context& io, const ServerAddress& server);
  ~WebSocketConnector();
  WebSocketConnector(const WebSocketConnector&) = delete;
  WebSocketConnector& operator=(const WebSocketConnector&) = delete;

  // Sets the address of the next connections. It may differ from the one before only in its host. Call on the
  // thread of the io_context, while no connection exists.
  void goTo(const ServerAddress& server);
  // Starts to open a connection. The connector must outlive it. Call on the thread of the io_context.
  std::unique_ptr<WebSocketConnection> open(WebSocketListener& listener);

 private:
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

}  // namespace clothstream
