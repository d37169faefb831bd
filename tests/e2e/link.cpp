// SPDX-License-Identifier: MIT
// A link to a server that can be cut.
#include "tests/e2e/link.h"

#include <array>
#include <cerrno>
#include <system_error>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace clothstream::e2e {
namespace {

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// With a reset, as if the other end had never been.
void reset(int socket) {
  const linger now{.l_onoff = 1, .l_linger = 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  close(socket);
}

// What one end said, to the other. False where either is gone.
bool pass(int from, int to) {
  std::array<char, 65536> bytes;
  const ssize_t count = recv(from, bytes.data(), bytes.size(), 0);
  if (count <= 0) return false;
  for (ssize_t sent = 0; sent < count;) {
    const ssize_t now = send(to, bytes.data() + sent, static_cast<std::size_t>(count - sent), MSG_NOSIGNAL);
    if (now <= 0) return false;
    sent += now;
  }
  return true;
}

}  // namespace

Link::Link(std::uint16_t target) : target_(target), listener_(socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (listener_ < 0 || bind(listener_, generic, size) != 0 || listen(listener_, 16) != 0 ||
      getsockname(listener_, generic, &size) != 0)
    throw std::system_error(errno, std::generic_category(), "link");
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { run(); });
}

Link::~Link() {
  stopping_ = true;
  thread_.join();
  close(listener_);
}

void Link::accept() {
  const int client = ::accept(listener_, nullptr, nullptr);
  if (client < 0) return;
  const int server = whole_ ? socket(AF_INET, SOCK_STREAM, 0) : -1;
  const sockaddr_in address = loopback(target_);
  if (server < 0 || connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    reset(client);
    if (server >= 0) close(server);
    return;
  }
  pairs_.push_back({client, server});
}

void Link::run() {
  while (!stopping_) {
    std::vector<pollfd> polled{{listener_, POLLIN, 0}};
    for (const Pair& pair : pairs_) {
      polled.push_back({pair.client, POLLIN, 0});
      polled.push_back({pair.server, POLLIN, 0});
    }
    poll(polled.data(), polled.size(), 5);
    std::vector<Pair> left;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      bool open = whole_;
      if (open && polled[1 + 2 * i].revents != 0) open = pass(pairs_[i].client, pairs_[i].server);
      if (open && polled[2 + 2 * i].revents != 0) open = pass(pairs_[i].server, pairs_[i].client);
      if (open) {
        left.push_back(pairs_[i]);
        continue;
      }
      reset(pairs_[i].client);
      reset(pairs_[i].server);
    }
    pairs_ = std::move(left);
    if (polled[0].revents != 0) accept();
  }
  for (const Pair& pair : pairs_) {
    reset(pair.client);
    reset(pair.server);
  }
}

}  // namespace clothstream::e2e
