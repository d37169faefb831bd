// SPDX-License-Identifier: MIT
// Accepts the connections of a gRPC server and limits their number, which gRPC cannot do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <grpcpp/server_builder.h>

#include "server/endpoint/listen/admission.h"
#include "server/telemetry/metrics.h"

namespace clothstream::endpoint {

class Acceptor {
 public:
  // Listens when it returns, and throws what listen() throws. `to` gets the connections.
  Acceptor(const std::string& host, std::uint16_t port, const ConnectionLimits& limits,
           std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> to,
           telemetry::ServerMetrics& metrics);
  // Stops accepting. Open connections stay open.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  std::uint16_t port() const { return address_.port(); }
  // Returns whether only programs of this machine can connect.
  bool isLoopback() const { return address_.address().is_loopback(); }
  // Call it when the server has started.
  void start();

 private:
  // A connection. gRPC owns its descriptor; `copy` is a duplicate that shows when the connection has ended.
  struct Connection {
    int copy;
    Admission::Ticket ticket;
  };

  void accept();
  void accepted(boost::asio::ip::tcp::socket socket);
  void checkLater();
  // Frees the places of connections that have ended.
  void forgetEnded();

  boost::asio::io_context io_{1};
  // Lets the thread run until io_.stop().
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_{io_}, check_{io_};
  const boost::asio::ip::tcp::endpoint address_;
  const std::size_t maxConnections_;
  Admission admission_;
  std::list<Connection> connections_;
  const std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> to_;
  telemetry::ServerMetrics& metrics_;
  std::thread thread_;
};

}  // namespace clothstream::endpoint
