// SPDX-License-Identifier: MIT
#include "server/session/session.h"

#include <algorithm>
#include <exception>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "server/delivery/mailbox.h"
#include "server/hosting/scene_server.h"
#include "server/identity/authenticator.h"
#include "server/messages/client_message.h"
#include "server/messages/datagram_offer.h"
#include "server/scene/remote_session.h"
#include "server/telemetry/log.h"

namespace clothstream::session {
namespace {

using delivery::Mailbox;
using delivery::SharedBytes;

constexpr double kMalformedCost = 60;
constexpr double kMegabyte = 1e6, kKilobyte = 1e3;
// Messages that this server answers for a peer of another one are not longer.
constexpr std::size_t kMaxOwnBytes = 512;

}  // namespace

Session::Session(hosting::SceneServer& server, Arrival arrival, std::function<void()> wake)
    : server_(server),
      peer_(std::move(arrival.peer)),
      address_(std::move(arrival.address)),
      continues_(arrival.continues),
      reached_(std::move(arrival.reached)),
      mailbox_(std::make_shared<Mailbox>(std::move(wake), arrival.atEdge)),
      opened_(Clock::now()),
      lastHeard_(opened_),
      identity_(server.connections),
      upload_(server.uploads, address_),
      surfaceUpload_(server.uploads, address_),
      readRate_(server.options.maxReadRate * kMegabyte, server.options.maxReadRate * kMegabyte) {}

std::shared_ptr<Session> Session::open(hosting::SceneServer& server, Arrival arrival,
                                       std::function<void()> wake) {
  const std::string token = std::move(arrival.token);
  std::shared_ptr<Session> session(new Session(server, std::move(arrival), std::move(wake)));
  if (SharedBytes refusal = server.connections.admit(session))
    session->close(std::move(refusal));
  else
    session->identify(token);
  // The server and pending answers may keep the session alive for a moment. Only the endpoint's pointer ends
  // it.
  return {session.get(), [session](Session*) mutable {
            session->end();
            session.reset();
          }};
}

std::optional<SharedBytes> Session::next() {
  if (const std::shared_ptr<scene::RemoteSession> remote = this->remote()) {
    if (std::optional<SharedBytes> message = remote->next()) return message;
    if (remote->ended()) mailbox_->close(nullptr);
  }
  return mailbox_->next(Clock::now());
}

std::shared_ptr<scene::RemoteSession> Session::remote() const {
  const std::lock_guard lock(remoteMutex_);
  return remote_;
}

bool Session::finished() const {
  return mailbox_->closed();
}

void Session::receive(std::span<const std::byte> bytes, Clock::time_point sent) {
  const Clock::time_point now = Clock::now();
  lastHeard_ = now;
  const std::lock_guard lock(mutex_);
  if (mailbox_->closed()) return;
  now_ = now;
  sent_ = std::max(sent_, sent);
  requestId_ = 0;
  readPause_ = readRate_.pay(now, static_cast<double>(bytes.size()));
  try {
    if (const std::shared_ptr<scene::RemoteSession> remote = this->remote()) {
      // The scenes that this peer can join are those of this server, and so are its datagrams.
      if (v1::ClientMessage own; bytes.size() <= kMaxOwnBytes && identity_.isKnown() &&
                                 own.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) &&
                                 (own.has_list_scenes() || own.has_datagram_offer())) {
        requestId_ = own.request_id();
        return dispatch(own);
      }
      if (!remote->send(bytes))
        cutOff(telemetry::Refusal::unreadAnswers,
               "the server that simulates the scene does not answer: join again");
      return;
    }
    if (!allowed(Rate::messages, "messages")) return;
    const messages::Result<v1::ClientMessage> message = messages::parseClientMessage(bytes);
    if (!message) return refuse(message.error(), kMalformedCost);
    requestId_ = message->request_id();
    dispatch(*message);
  } catch (const std::exception& failure) {
    // This ends neither the endpoint's thread nor other sessions.
    spdlog::error("{}: a message failed: {}", peer_, failure.what());
    closeLocked(delivery::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                "the server could not handle the message; try again later", true, requestId_),
                DisconnectReason::lost);
  }
}

void Session::openDatagrams(const v1::DatagramOffer& message) {
  messages::Result<messages::DatagramOffer> offer = messages::toDatagramOffer(message);
  if (!offer) return refuse(offer.error());
  datagrams_.reset();
  v1::ServerMessage reply;
  v1::DatagramAnswer& answered = *reply.mutable_datagram_answer();
  // A participant at an edge has its datagrams there, with the frames of the server that simulates the scene.
  const std::shared_ptr<scene::RemoteSession> remote = this->remote();
  const bool hasFrames = remote || (scene_ != nullptr && !inLockstep() && !mailbox_->atEdge());
  if (hosting::DatagramGate* const gate = server_.datagrams.load(); gate != nullptr && hasFrames) {
    auto opened = gate->open({.name = peer_,
                              .reached = reached_,
                              .offer = std::move(*offer),
                              .outlet = remote ? std::shared_ptr<delivery::LinkOutlet>(remote) : mailbox_,
                              .receive = [weak = weak_from_this()](std::span<const std::byte> bytes) {
                                if (const std::shared_ptr<Session> session = weak.lock())
                                  session->receive(bytes);
                              }});
    if (opened) {
      answered = std::move(opened->answer);
      datagrams_ = std::move(opened->association);
    }
  }
  answer(reply);
}

void Session::answer(v1::ServerMessage& message) {
  message.set_request_id(requestId_);
  if (mailbox_->reply(delivery::serialise(message))) return;
  server_.metrics.droppedConnections.add();
  server_.metrics.refuse(telemetry::Refusal::unreadAnswers);
  spdlog::warn("{}: does not read its answers; disconnected", peer_);
  closeLocked(delivery::tooSlow(), DisconnectReason::lost);
}

void Session::refuseUnless(const messages::Result<void>& done) {
  if (!done) refuse(done.error());
}

void Session::refuse(const messages::FieldError& reason, double cost) {
  (scene_ != nullptr ? scene_->metrics.rejectedMessages : server_.metrics.rejectedMessages).add();
  if (reason.limit) server_.metrics.refuse(*reason.limit);
  spdlog::debug("{}: refused: {}", peer_, reason.text);
  if (!bucket(Rate::offences).take(now_, cost)) {
    server_.metrics.droppedConnections.add();
    return fail(reason.code, "too many refused messages; the last one: " + reason.text);
  }
  if (!bucket(Rate::errors).take(now_)) return;
  v1::ServerMessage message;
  message.mutable_error()->set_code(reason.code);
  message.mutable_error()->set_text(reason.text);
  answer(message);
}

void Session::fail(v1::ErrorCode code, std::string text, std::string server) {
  spdlog::info("{}: closed: {}", peer_, text);
  closeLocked(delivery::error(code, std::move(text), true, requestId_, std::move(server)),
              DisconnectReason::removed);
}

bool Session::allowed(Rate rate, const char* what) {
  if (bucket(rate).take(sent_)) return true;
  refuse({v1::ERROR_CODE_RATE_LIMITED, fmt::format("too many {}: this one was ignored", what),
          telemetry::Refusal::messageRate});
  return false;
}

void Session::close(SharedBytes last) {
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(std::move(last), DisconnectReason::lost);
}

void Session::closeLocked(SharedBytes last, DisconnectReason reason) {
  mailbox_->close(std::move(last));
  disconnect(reason);
}

void Session::leave() {
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(nullptr, DisconnectReason::left);
}

void Session::closePage() {
  if (server_.options.reconnectGrace.page <= Clock::duration::zero()) return leave();
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(nullptr, DisconnectReason::pageClosed);
}

void Session::checkSilence(Clock::time_point now) {
  const hosting::ServerOptions& options = server_.options;
  // The caller checks every peer. A session that handles a message is not silent; the next call checks it.
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  // A mailbox that others closed, such as the scene's roster, is noticed here too.
  if (mailbox_->closed()) {
    now_ = now;
    return disconnect(DisconnectReason::lost);
  }
  // The server that simulates the scene decides about all the rest.
  if (remote()) return;
  // A stream in a scene has some time to send a new token.
  const auto grace = scene_ ? identity::Authenticator::kExpiryGrace : std::chrono::seconds(0);
  if (const char* const why = identity_.isKnown() && options.authenticator
                                  ? options.authenticator->whyEnded(*identity_, grace)
                                  : nullptr) {
    now_ = now;
    spdlog::info("{}: disconnected: {}", peer_, why);
    return closeLocked(delivery::error(v1::ERROR_CODE_UNAUTHENTICATED, why, true), DisconnectReason::lost);
  }
  requestId_ = 0;
  now_ = now;
  refuseUnless(upload_.checkPace({options.maxUploadTime, options.minUploadRate * kKilobyte}, now));
  if (const auto tick = mailbox_->overdue(now - options.silence))
    return cutOff(
        telemetry::Refusal::silence,
        fmt::format("the client has not acknowledged the frame of tick {} within {} s: the recording is "
                    "played in lockstep, so acknowledge every frame (welcome.acknowledge_every_frame)",
                    *tick, schedule::seconds(options.silence)));
  if (now - lastHeard_.load() > options.silence)
    return cutOff(telemetry::Refusal::silence,
                  fmt::format("the client was silent for {} s: acknowledge frames, or send pings",
                              schedule::seconds(options.silence)));
  if (scene_ || asked_ > 0) return;
  const std::chrono::milliseconds time =
      options.helloTimeout + (upload_.hasBegun() ? options.maxUploadTime : std::chrono::milliseconds(0));
  if (now - opened_ > time)
    cutOff(telemetry::Refusal::helloTimeout,
           fmt::format("the client joined no scene within {} s: send hello soon after connecting (--profile)",
                       schedule::seconds(time)));
}

void Session::cutOff(telemetry::Refusal reason, const std::string& text) {
  server_.metrics.droppedConnections.add();
  server_.metrics.refuse(reason);
  spdlog::info("{}: disconnected: {}", peer_, text);
  closeLocked(delivery::error(v1::ERROR_CODE_CUT_OFF, text, true), DisconnectReason::lost);
}

void Session::end() {
  mailbox_->silence();
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(nullptr, DisconnectReason::lost);
  identity_.release();
}

void Session::disconnect(DisconnectReason reason) {
  using End = scene::RemoteSession::End;
  datagrams_.reset();
  if (const std::shared_ptr<scene::RemoteSession> remote = this->remote())
    remote->end(reason == DisconnectReason::left         ? End::left
                : reason == DisconnectReason::pageClosed ? End::pageClosed
                                                         : End::lost);
  if (scene_ == nullptr) return;
  const bool mayReturn = reason == DisconnectReason::lost || reason == DisconnectReason::pageClosed;
  scene::ReconnectGrace grace = server_.options.reconnectGrace;
  if (reason == DisconnectReason::pageClosed) grace.place = std::min(grace.place, grace.page);
  if (mayReturn)
    scene_->roster.disconnect(*mailbox_, grace, now_);
  else
    scene_->roster.leave(
        *mailbox_, reason == DisconnectReason::left ? scene::LeaveReason::left : scene::LeaveReason::removed,
        now_);
  server_.device.wake(*scene_);
  telemetry::log({scene_->name(), participant_}, spdlog::level::info, "{} {}; {} in it", peer_,
                 mayReturn ? "was disconnected" : "left", scene_->subscribers.size());
  scene_ = nullptr;
}

}  // namespace clothstream::session
