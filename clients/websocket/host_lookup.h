// SPDX-License-Identifier: MIT
// Looks up the addresses of a host without making anyone wait for the name server.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace clothstream {

// Belongs to the thread of the io_context. A lookup that is under way when the object is destroyed ends on
// its thread later, because getaddrinfo() cannot be interrupted. At most one is under way.
class HostLookup {
 public:
  using Found = boost::asio::ip::tcp::resolver::results_type;
  using Handler = std::function<void(boost::system::error_code, const Found&)>;

  // `io` must outlive the object.
  HostLookup(boost::asio::io_context& io, const std::string& host, const std::string& port);
  ~HostLookup();
  HostLookup(const HostLookup&) = delete;
  HostLookup& operator=(const HostLookup&) = delete;

  // Calls the handler on the io_context, not inside this call.
  void find(Handler handler);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace clothstream
