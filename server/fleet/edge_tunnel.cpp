// SPDX-License-Identifier: MIT
#include "server/fleet/edge_tunnel.h"

#include <chrono>
#include <utility>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"

namespace clothstream::fleet {

using delivery::SharedBytes;
using schedule::Clock;

namespace {

// Each end of a channel sends something once per second.
constexpr std::chrono::milliseconds kSilence{1500};
// Pings and Pongs are not longer.
constexpr std::size_t kMaxPingBytes = 64;
// Beyond so many messages for the peer, pings wait for the origin.
constexpr std::size_t kMaxAnswers = 64;
// Nor are requests that say who the peer is: Hello, and a token of at most 4096 bytes.
constexpr std::size_t kMaxRequestBytes = 8192;

// Interval of requests for a key frame that does not come.
constexpr std::chrono::seconds kKeyFrameInterval{1};

constexpr std::chrono::seconds kStrangerTime{30};
constexpr std::size_t kMaxStrangers = 1024;

}  // namespace

void Strangers::add(std::string resumeToken) {
  const Clock::time_point now = Clock::now();
  const std::lock_guard lock(mutex_);
  std::erase_if(until_, [&](const auto& known) { return known.second < now; });
  if (until_.size() < kMaxStrangers) until_[std::move(resumeToken)] = now + kStrangerTime;
}

bool Strangers::contains(const std::string& resumeToken) const {
  const std::lock_guard lock(mutex_);
  const auto found = until_.find(resumeToken);
  return found != until_.end() && Clock::now() <= found->second;
}

EdgeTunnel::EdgeTunnel(Nats& nats, std::string stream, const TunnelId& id, const scene::RemotePeer& peer,
                       std::shared_ptr<Strangers> strangers, std::function<void()> wake)
    : nats_(nats),
      id_(id),
      strangers_(std::move(strangers)),
      wake_(std::move(wake)),
      stream_(std::move(stream)) {
  open_.set_peer(peer.name);
  open_.set_address(peer.address);
  open_.set_token(peer.token);
}

EdgeTunnel::~EdgeTunnel() = default;

bool EdgeTunnel::send(std::span<const std::byte> message) {
  const std::lock_guard lock(mutex_);
  if (closed_ || left_) return true;  // the peer learns why
  if (answerPing(message, Clock::now())) return true;
  if (channel_.bytes() + message.size() > kMaxWaiting) return false;
  if (message.size() <= kMaxRequestBytes) readRequest(message);
  pushLocked(message);
  pollLocked();
  return true;
}

void EdgeTunnel::pushLocked(std::span<const std::byte> message) {
  channel_.push(std::make_shared<std::vector<std::byte>>(message.begin(), message.end()), Clock::now());
}

bool EdgeTunnel::answerPing(std::span<const std::byte> message, Clock::time_point now) {
  v1::ClientMessage ping;
  if (!serverAheadUs_ || now - heardAt_ < kSilence || message.size() > kMaxPingBytes ||
      messages_.size() > kMaxAnswers || !parse(message, ping) || !ping.has_ping())
    return false;
  v1::ServerMessage answer;
  answer.set_request_id(ping.request_id());
  answer.mutable_pong()->set_client_time_us(ping.ping().client_time_us());
  answer.mutable_pong()->set_server_time_us(schedule::microseconds(now) +
                                            static_cast<std::uint64_t>(*serverAheadUs_));
  messages_.add(delivery::serialise(answer));
  wake_();
  return true;
}

std::optional<SharedBytes> EdgeTunnel::next() {
  const std::lock_guard lock(mutex_);
  SharedBytes next = messages_.next();
  if (!next) return std::nullopt;
  noteTaken();
  // A frame that was too long for the link has left.
  if (frameWake_ && messages_.hasNextFrame()) frameWake_();
  return next;
}

std::optional<SharedBytes> EdgeTunnel::nextFrame(Clock::time_point /*now*/) {
  const std::lock_guard lock(mutex_);
  SharedBytes frame = messages_.nextFrame();
  if (!frame) return std::nullopt;
  noteTaken();
  if (messages_.hasNext()) wake_();
  return frame;
}

void EdgeTunnel::noteTaken() {
  channel_.use(messages_.taken());
  pollLocked();
}

void EdgeTunnel::setLink(std::optional<Link> link) {
  const std::lock_guard lock(mutex_);
  messages_.setLink(link);
  if (!link) noteTaken();
  if (messages_.hasNext()) wake_();
  if (frameWake_ && messages_.hasNextFrame()) frameWake_();
}

void EdgeTunnel::setFrameWake(std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  frameWake_ = std::move(wake);
}

bool EdgeTunnel::ended() const {
  const std::lock_guard lock(mutex_);
  return closed_ && !messages_.hasNext();
}

void EdgeTunnel::end(End how) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(left_, true) || closed_) return;
  messages_.clear();
  if (!known_) {  // a peer that tried to join without NATS
    closed_ = true;
    return;
  }
  channel_.pushEnd(how == End::left         ? v1::TUNNEL_END_LEFT
                   : how == End::pageClosed ? v1::TUNNEL_END_PAGE_CLOSED
                                            : v1::TUNNEL_END_LOST);
  pollLocked();
}

void EdgeTunnel::receive(const std::string& stream, const v1::Segment& segment) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || stream != stream_) return;
    if (segment.unknown()) {
      closed_ = true;
      if (!left_)
        messages_.add(delivery::error(
            v1::ERROR_CODE_CUT_OFF,
            "the server that simulates the scene has lost this participant: join again", true));
    }
    const Clock::time_point now = Clock::now();
    heardAt_ = now;
    for (Channel::Received& received : channel_.receive(segment, now)) {
      if (!received.message || left_) {
        closed_ = closed_ || !received.message;
        channel_.use(received.sequence);
        continue;
      }
      if (!welcomed_ || !token_.empty()) readAnswer(received.message);
      if (v1::ServerMessage pong;
          received.message->size() <= kMaxPingBytes && parse(*received.message, pong) && pong.has_pong())
        serverAheadUs_ =
            static_cast<std::int64_t>(pong.pong().server_time_us() - schedule::microseconds(now));
      messages_.add(std::move(received.message), received.sequence);
    }
    noteTaken();  // dropped frames, too
    if (left_) return;
    if (frameWake_ && messages_.hasNextFrame()) frameWake_();
  }
  wake_();
}

void EdgeTunnel::readRequest(std::span<const std::byte> message) {
  v1::ClientMessage parsed;
  if (!parse(message, parsed)) return;
  if (parsed.has_frame_ack()) messages_.acknowledge(parsed.frame_ack().tick());
  if (parsed.has_hello() && !hello_.protocol_version()) hello_ = parsed.hello();
  if (!parsed.has_authenticate() || parsed.authenticate().token().empty()) return;
  token_ = parsed.authenticate().token();
  tokenRequest_ = parsed.request_id();
}

void EdgeTunnel::readAnswer(const SharedBytes& message) {
  v1::ServerMessage parsed;
  if (!parse(*message, parsed)) return;
  if (parsed.has_welcome()) {
    welcomed_ = true;
    hello_.set_resume_token(parsed.welcome().resume_token());
    hello_.set_description_content_id(parsed.welcome().description_content_id());
  }
  // The client tries again, and then views.
  if (!welcomed_ && parsed.error().code() == v1::ERROR_CODE_RESOURCE_EXHAUSTED &&
      !hello_.resume_token().empty())
    strangers_->add(hello_.resume_token());
  if (token_.empty() || parsed.request_id() != tokenRequest_) return;
  if (parsed.has_authenticate()) open_.set_token(token_);
  token_.clear();
}

bool EdgeTunnel::poll() {
  const std::lock_guard lock(mutex_);
  pollLocked();
  return !(left_ && (closed_ || channel_.delivered()));
}

void EdgeTunnel::pollLocked() {
  if (!nats_.connected()) return;
  const bool opens = !channel_.heard();
  known_ = true;
  const Clock::time_point now = Clock::now();
  if (messages_.needsKeyFrame() && !closed_ && !left_ && now - keyFrameAsked_ >= kKeyFrameInterval) {
    keyFrameAsked_ = now;
    v1::ClientMessage request;
    request.mutable_key_frame_request();
    pushLocked(*toBytes(request));
  }
  channel_.poll(now, [&](const v1::Segment& segment) {
    if (!opens) return nats_.publish(upSubject(stream_, id_), toBytes(segment));
    v1::Segment opening = segment;
    *opening.mutable_open() = open_;
    nats_.publish(upSubject(stream_, id_), toBytes(opening));
  });
}

void EdgeTunnel::moveTo(std::string stream) {
  const std::lock_guard lock(mutex_);
  if (closed_ || stream == stream_) return;
  if (!welcomed_) {
    closed_ = true;
    messages_.add(
        delivery::error(v1::ERROR_CODE_CUT_OFF, "the scene has moved to another server: join again", true));
    wake_();
    return;
  }
  stream_ = std::move(stream);
  channel_.restart();
  messages_.forgetChannel();
  *open_.mutable_continues() = hello_;
  pollLocked();
}

void EdgeTunnel::close(const SharedBytes& last) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    closed_ = true;
    if (last && !left_) messages_.add(last);
  }
  wake_();
}

void EdgeTunnel::tell(SharedBytes message) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || left_) return;
    messages_.add(std::move(message));
  }
  wake_();
}

std::shared_ptr<scene::RemoteSession> EdgeTunnels::connect(const scene::RemotePeer& peer,
                                                           std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  if (!last_ && !hasRoom_ && (peer.resumeToken.empty() || strangers_->contains(peer.resumeToken)))
    return nullptr;
  const TunnelId id{edge_, randomId()};
  auto tunnel = std::make_shared<EdgeTunnel>(nats_, stream_, id, peer, strangers_, std::move(wake));
  if (last_)
    tunnel->close(*last_);
  else
    tunnels_.emplace(id.peer, tunnel);
  return tunnel;
}

std::vector<std::shared_ptr<EdgeTunnel>> EdgeTunnels::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<EdgeTunnel>> now;
  for (const auto& [peer, tunnel] : tunnels_) now.push_back(tunnel);
  return now;
}

void EdgeTunnels::receive(const std::string& stream, const std::string& subject,
                          std::span<const std::byte> bytes) {
  const std::optional<TunnelId> id = tunnelOf(subject);
  v1::Segment segment;
  if (!id || !parse(bytes, segment)) return;
  std::shared_ptr<EdgeTunnel> tunnel;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = tunnels_.find(id->peer); found != tunnels_.end()) tunnel = found->second;
  }
  if (tunnel) tunnel->receive(stream, segment);
}

void EdgeTunnels::poll() {
  for (const auto& tunnel : all()) {
    if (tunnel->poll()) continue;
    const std::lock_guard lock(mutex_);
    tunnels_.erase(tunnel->id().peer);
  }
}

void EdgeTunnels::moveTo(const std::string& stream) {
  {
    const std::lock_guard lock(mutex_);
    stream_ = stream;
  }
  for (const auto& tunnel : all()) tunnel->moveTo(stream);
}

void EdgeTunnels::close(const SharedBytes& last) {
  {
    const std::lock_guard lock(mutex_);
    last_ = last;
  }
  for (const auto& tunnel : all()) tunnel->close(last);
}

void EdgeTunnels::tell(const SharedBytes& message) {
  for (const auto& tunnel : all()) tunnel->tell(message);
}

}  // namespace clothstream::fleet
