// SPDX-License-Identifier: MIT
#include "clients/websocket/host_lookup.h"

#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>

namespace clothstream {

namespace net = boost::asio;
using boost::system::error_code;
using net::ip::tcp;

struct HostLookup::State : std::enable_shared_from_this<State> {
  // Calls the handlers, on the io_context.
  void finish(error_code error, const Found& found) {
    looks = false;
    for (const Handler& handler : std::exchange(handlers, {})) handler(error, found);
  }
  void postFinish(error_code error, const Found& found) {
    const std::lock_guard lock(mutex);
    if (io != nullptr)
      net::post(*io, [self = shared_from_this(), error, found] { self->finish(error, found); });
  }

  std::string host, port;
  std::vector<Handler> handlers;
  bool looks = false;

  std::mutex mutex;
  net::io_context* io = nullptr;  // guarded by the mutex; nullptr when the lookup is destroyed
};

HostLookup::HostLookup(net::io_context& io, const std::string& host, const std::string& port)
    : state_(std::make_shared<State>()) {
  state_->host = host;
  state_->port = port;
  state_->io = &io;
}

HostLookup::~HostLookup() {
  const std::lock_guard lock(state_->mutex);
  state_->io = nullptr;
}

void HostLookup::find(Handler handler) {
  state_->handlers.push_back(std::move(handler));
  if (std::exchange(state_->looks, true)) return;
  error_code isName;
  const net::ip::address address = net::ip::make_address(state_->host, isName);
  if (!isName) {
    const auto port = static_cast<std::uint16_t>(std::stoul(state_->port));
    return state_->postFinish({}, Found::create(tcp::endpoint(address, port), state_->host, state_->port));
  }
  try {
    std::thread([state = state_] {
      net::io_context io;
      error_code error;
      const Found found = tcp::resolver(io).resolve(state->host, state->port, error);
      state->postFinish(error, found);
    }).detach();
  } catch (const std::system_error&) {
    state_->postFinish(net::error::no_memory, {});
  }
}

}  // namespace clothstream
