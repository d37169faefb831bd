// SPDX-License-Identifier: MIT
#include "server/hosting/connections.h"

#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::hosting {
namespace {

delivery::SharedBytes stoppingNotice(std::chrono::milliseconds drain) {
  const float seconds = std::chrono::duration<float>(drain).count();
  v1::ServerMessage message;
  v1::Notice& notice = *message.mutable_notice();
  notice.set_kind(v1::NOTICE_KIND_SERVER_STOPPING);
  notice.set_text(fmt::format("the server is stopping; it ends within {} s", seconds));
  notice.set_ends_within_seconds(seconds);
  return delivery::serialise(message);
}

}  // namespace

Connections::Connections(const ServerOptions& options, telemetry::ServerMetrics& metrics)
    : options_(options), metrics_(metrics) {}

delivery::SharedBytes Connections::admit(const std::shared_ptr<Peer>& peer) {
  const std::lock_guard lock(mutex_);
  if (closed_) {
    metrics_.refuse(telemetry::Refusal::stopping);
    return stoppingNotice(options_.drain);
  }
  std::erase_if(peers_, [](const auto& known) { return known.expired(); });
  if (peers_.size() >= options_.maxConnections) {
    metrics_.refuse(telemetry::Refusal::connections);
    return delivery::error(
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("the server has {} connections, its maximum; try again later", peers_.size()), true);
  }
  metrics_.connections.add();
  peers_.push_back(peer);
  return nullptr;
}

std::vector<std::shared_ptr<Peer>> Connections::peers() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Peer>> now;
  for (const auto& peer : peers_)
    if (auto alive = peer.lock()) now.push_back(std::move(alive));
  return now;
}

std::shared_ptr<const void> Connections::count(const Identity& identity) {
  static const int uncounted = 0;
  if (!identity.verified) return {std::shared_ptr<const void>(), &uncounted};
  auto release = [this, subject = identity.subject](const void*) {
    const std::lock_guard lock(mutex_);
    const auto known = ofSubjects_.find(subject);
    if (--known->second == 0) ofSubjects_.erase(known);
  };
  {
    const std::lock_guard lock(mutex_);
    std::uint32_t& open = ofSubjects_[identity.subject];
    if (open >= options_.maxConnectionsPerToken) {
      metrics_.refuse(telemetry::Refusal::connectionsOfToken);
      return nullptr;
    }
    ++open;
  }
  return {&uncounted, std::move(release)};
}

void Connections::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  const delivery::SharedBytes notice = stoppingNotice(options_.drain);
  for (const auto& peer : peers()) peer->close(notice);
}

}  // namespace clothstream::hosting
