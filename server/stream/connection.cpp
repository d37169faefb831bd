// SPDX-License-Identifier: MIT
// What a endpoint sees of a session.
#include "server/stream/connection.h"

#include <utility>

#include "server/stream/server_state.h"
#include "server/stream/session.h"

namespace clothstream::stream {

Connection::Connection(SceneServer& server, std::string peer, std::function<void()> wake)
    : session_(std::make_shared<Session>(server.state(), std::move(peer), std::move(wake))) {
  if (SharedBytes refusal = server.state().add(session_)) session_->close(std::move(refusal));
}

Connection::~Connection() {
  session_->end();
}

void Connection::receive(std::span<const std::byte> message) {
  session_->receive(message, Clock::now());
}

void Connection::leave() {
  session_->leave();
}

std::optional<SharedBytes> Connection::next() {
  return session_->next(Clock::now());
}

bool Connection::finished() const {
  return session_->finished();
}

}  // namespace clothstream::stream
