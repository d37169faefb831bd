// SPDX-License-Identifier: MIT
#include "server/fleet/origin_tunnels.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/fleet/channel.h"
#include "server/fleet/message_bytes.h"
#include "server/hosting/scene_server.h"
#include "server/session/session.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::fleet {
namespace {

using schedule::Clock;
using namespace std::chrono_literals;

constexpr auto kPollPeriod = 20ms;
// An edge that does not confirm the end of a tunnel for this long is gone.
constexpr auto kEndTime = 5s;
// An edge that has ended a tunnel learns for this long that this is known here.
constexpr auto kFarewellTime = 200ms;
// Longest wait for edges that learn the end of sessions when this server ends.
constexpr auto kLastWords = 1s;
// Tunnels that may be expected at a time.
constexpr std::size_t kMaxExpected = 65536;
// Address of a peer of an edge's own machine, so that it is not taken for one of this machine.
constexpr const char* kEdgeAddress = "edge";

}  // namespace

struct OriginTunnels::Tunnel {
  Tunnel(Key key_, std::uint64_t used) : key(std::move(key_)), channel(used) {}

  const Key key;
  std::mutex receiving;  // held while the session handles a message; protects `frozen`
  bool frozen = false;

  std::mutex mutex;  // protects the following
  Channel channel;
  std::shared_ptr<session::Session> session;
  // Time of this server at which a message was sent, by the time of the edge. The first one counts as sent
  // now.
  Clock::time_point sentAt(std::uint64_t timeUs) {
    const Clock::time_point now = Clock::now();
    const auto time = std::chrono::duration_cast<Clock::duration>(std::chrono::microseconds(timeUs));
    if (!edgeClock) edgeClock = now - time;
    return std::min(now, *edgeClock + time);
  }

  std::optional<Clock::time_point> edgeClock;  // its zero; used while `receiving` is held
  bool closed = false;                         // the session has ended
  std::optional<Clock::time_point> removeAt;
};

OriginTunnels::OriginTunnels(hosting::SceneServer& server, Nats& nats)
    : server_(server), nats_(nats), thread_([this] { run(); }) {}

OriginTunnels::~OriginTunnels() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  // The release of a session waits for its `wake`, which takes the lock of this.
  for (const auto& tunnel : all()) tunnel->session.reset();
}

std::shared_ptr<OriginTunnels::Tunnel> OriginTunnels::find(const Key& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = tunnels_.find(key);
  return found == tunnels_.end() ? nullptr : found->second;
}

std::vector<std::shared_ptr<OriginTunnels::Tunnel>> OriginTunnels::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Tunnel>> now;
  for (const auto& [key, tunnel] : tunnels_) now.push_back(tunnel);
  return now;
}

std::vector<std::shared_ptr<OriginTunnels::Tunnel>> OriginTunnels::of(const std::string& stream) const {
  std::vector<std::shared_ptr<Tunnel>> found = all();
  std::erase_if(found, [&](const auto& tunnel) { return tunnel->key.first != stream; });
  return found;
}

std::shared_ptr<OriginTunnels::Tunnel> OriginTunnels::open(const Key& key, const v1::OpenTunnel& request) {
  std::uint64_t used = 0;
  {
    const std::lock_guard lock(mutex_);
    if (const auto expected = expected_.find(key); expected != expected_.end()) {
      used = expected->second;
      expected_.erase(expected);
    } else if (request.has_continues()) {
      return nullptr;
    }
  }
  auto tunnel = std::make_shared<Tunnel>(key, used);
  tunnel->session =
      session::Session::open(server_,
                             {.peer = fmt::format("{} at an edge", request.peer()),
                              .address = request.address().empty() ? kEdgeAddress : request.address(),
                              .token = request.token(),
                              .continues = request.has_continues(),
                              .atEdge = true},
                             [this, key] { wake(key); });
  if (request.has_continues()) {
    v1::ClientMessage hello;
    *hello.mutable_hello() = request.continues();
    tunnel->session->receive(*toBytes(hello));
  }
  {
    const std::lock_guard lock(mutex_);
    tunnels_[key] = tunnel;
  }
  wake(key);
  return tunnel;
}

void OriginTunnels::receive(const std::string& stream, const std::string& subject,
                            std::span<const std::byte> bytes) {
  const std::optional<TunnelId> id = tunnelOf(subject);
  v1::Segment segment;
  if (!id || !parse(bytes, segment)) return server_.metrics.nats.refused.add();
  const Key key{stream, *id};
  std::shared_ptr<Tunnel> tunnel = find(key);
  if (!tunnel && segment.has_open()) tunnel = open(key, segment.open());
  if (!tunnel) {
    v1::Segment answer;
    answer.set_unknown(true);
    return nats_.publish(downSubject(stream, *id), toBytes(answer));
  }
  const std::lock_guard receiving(tunnel->receiving);
  if (tunnel->frozen) return;
  std::vector<Channel::Received> messages;
  std::shared_ptr<session::Session> session;
  {
    const std::lock_guard lock(tunnel->mutex);
    messages = tunnel->channel.receive(segment, Clock::now());
    session = tunnel->session;
  }
  for (const Channel::Received& received : messages) {
    if (session && received.message) session->receive(*received.message, tunnel->sentAt(received.timeUs));
    if (session && received.end == v1::TUNNEL_END_LEFT) session->leave();
    if (session && received.end == v1::TUNNEL_END_PAGE_CLOSED) session->closePage();
    const std::lock_guard lock(tunnel->mutex);
    tunnel->channel.use(received.sequence);
    if (received.message) continue;
    tunnel->session.reset();
    tunnel->removeAt = Clock::now() + kFarewellTime;
  }
  wake(key);
}

void OriginTunnels::wake(const Key& key) {
  {
    const std::lock_guard lock(mutex_);
    woken_.push_back(key);
  }
  changed_.notify_one();
}

bool OriginTunnels::pump(Tunnel& tunnel) {
  const Clock::time_point now = Clock::now();
  const std::lock_guard lock(tunnel.mutex);
  while (tunnel.session && !tunnel.closed && tunnel.channel.hasRoom()) {
    const bool finished = tunnel.session->finished();  // checked before next(), so that no message is lost
    if (const std::optional<delivery::SharedBytes> message = tunnel.session->next()) {
      tunnel.channel.push(*message, now);
    } else {
      if (!finished) break;
      tunnel.channel.pushEnd(v1::TUNNEL_END_CLOSED);
      tunnel.closed = true;
      tunnel.removeAt = now + kEndTime;
    }
  }
  if (nats_.connected())
    tunnel.channel.poll(now, [&](const v1::Segment& segment) {
      nats_.publish(downSubject(tunnel.key.first, tunnel.key.second), toBytes(segment));
    });
  return !tunnel.removeAt || (now < *tunnel.removeAt && !(tunnel.closed && tunnel.channel.delivered()));
}

void OriginTunnels::run() {
  telemetry::nameThread("tunnels");
  Clock::time_point nextPoll = Clock::now();
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const auto something = [this] { return stopping_ || !woken_.empty(); };
    if (tunnels_.empty())
      changed_.wait(lock, something);
    else
      changed_.wait_until(lock, nextPoll, something);
    std::deque<Key> woken = std::exchange(woken_, {});
    lock.unlock();
    {  // tunnels that ended are destroyed without the lock
      std::vector<std::shared_ptr<Tunnel>> due;
      if (Clock::now() >= nextPoll) {
        due = all();
        nextPoll = Clock::now() + kPollPeriod;
      } else {
        for (const Key& key : woken)
          if (auto tunnel = find(key)) due.push_back(std::move(tunnel));
      }
      for (const auto& tunnel : due) {
        if (pump(*tunnel)) continue;
        {
          const std::lock_guard erasing(mutex_);
          tunnels_.erase(tunnel->key);
        }
        std::shared_ptr<session::Session> session;
        {
          const std::lock_guard ending(tunnel->mutex);
          session = std::move(tunnel->session);
        }
      }
    }
    lock.lock();
  }
}

void OriginTunnels::end(const std::string& stream) {
  for (const auto& tunnel : of(stream)) {
    const std::lock_guard receiving(tunnel->receiving);
    tunnel->frozen = true;
    {
      const std::lock_guard lock(mutex_);
      tunnels_.erase(tunnel->key);
    }
    std::shared_ptr<session::Session> session;
    const std::lock_guard lock(tunnel->mutex);
    session = std::move(tunnel->session);
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(expected_, [&](const auto& known) { return known.first.first == stream; });
}

void OriginTunnels::deliverEnds() const {
  const auto ending = [](const auto& tunnel) {
    const std::lock_guard lock(tunnel->mutex);
    return tunnel->session && tunnel->session->finished();
  };
  const Clock::time_point end = Clock::now() + kLastWords;
  while (nats_.connected() && Clock::now() < end && std::ranges::any_of(all(), ending))
    std::this_thread::sleep_for(kPollPeriod / 4);
}

std::vector<v1::MovedTunnel> OriginTunnels::freeze(const std::string& stream) {
  std::vector<v1::MovedTunnel> used;
  for (const auto& tunnel : of(stream)) {
    const std::lock_guard receiving(tunnel->receiving);
    tunnel->frozen = true;
    const std::lock_guard lock(tunnel->mutex);
    v1::MovedTunnel& moved = used.emplace_back();
    moved.set_edge(tunnel->key.second.edge);
    moved.set_peer(tunnel->key.second.peer);
    moved.set_acknowledged(tunnel->channel.received());
  }
  return used;
}

void OriginTunnels::thaw(const std::string& stream) {
  for (const auto& tunnel : of(stream)) {
    const std::lock_guard receiving(tunnel->receiving);
    tunnel->frozen = false;
  }
}

void OriginTunnels::expect(const std::string& stream, const std::vector<v1::MovedTunnel>& tunnels) {
  const std::lock_guard lock(mutex_);
  for (const v1::MovedTunnel& moved : tunnels)
    if (expected_.size() < kMaxExpected)
      expected_[{stream, {moved.edge(), moved.peer()}}] = moved.acknowledged();
}

}  // namespace clothstream::fleet
