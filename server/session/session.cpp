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
#include "server/hosting/server_state.h"
#include "server/identity/authenticator.h"
#include "server/messages/client_message.h"
#include "server/schedule/retry.h"
#include "server/telemetry/log.h"

namespace clothstream::session {
namespace {

using delivery::Mailbox;
using delivery::SharedBytes;
using scene::Action;

constexpr double kMalformedCost = 60;
constexpr double kMegabyte = 1e6, kKilobyte = 1e3;
// Largest answer in a stream; it bounds the memory that a peer costs. Scenes with large meshes need the unary
// call.
constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;

}  // namespace

Session::Session(hosting::SceneServer::State& server, Arrival arrival, std::function<void()> wake)
    : server_(server),
      peer_(std::move(arrival.peer)),
      address_(std::move(arrival.address)),
      mailbox_(std::make_shared<Mailbox>(std::move(wake))),
      opened_(Clock::now()),
      lastHeard_(opened_),
      upload_(server.uploads, address_),
      readRate_(server.options.maxReadRate * kMegabyte, server.options.maxReadRate * kMegabyte) {}

std::shared_ptr<Session> Session::open(hosting::SceneServer& server, Arrival arrival,
                                       std::function<void()> wake) {
  const std::string token = std::move(arrival.token);
  std::shared_ptr<Session> session(new Session(server.state(), std::move(arrival), std::move(wake)));
  if (SharedBytes refusal = server.state().admit(session))
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

void Session::identify(const std::string& token) {
  const std::lock_guard lock(mutex_);
  if (mailbox_->closed()) return;
  now_ = Clock::now();
  messages::Result<identity::Identity> identity = server_.identify(token, address_.empty());
  if (identity)
    become(std::move(*identity));
  else if (token.empty())
    whyUnknown_ = identity.error().text;
  else
    fail(identity.error().code, identity.error().text);
}

bool Session::become(identity::Identity identity) {
  // A new token of the same subject replaces the former one.
  const bool same = identity_ && identity_->verified && identity_->subject == identity.subject;
  if (!same) {
    counted_.reset();
    counted_ = server_.countConnection(identity);
  }
  if (!counted_) {
    fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
         fmt::format("your token has {} open connections, its maximum (--max-connections-per-token)",
                     server_.options.maxConnectionsPerToken));
    return false;
  }
  identity_ = std::move(identity);
  return true;
}

void Session::authenticate(const v1::AuthenticateRequest& request) {
  v1::ServerMessage reply;
  messages::Result<identity::Identity> identity =
      server_.authenticate(request, address_, now_, *reply.mutable_authenticate());
  if (!identity && scene_ != nullptr) return refuse(identity.error());
  if (!identity) return fail(identity.error().code, identity.error().text);
  if (scene_ != nullptr && identity->verified &&
      (identity->subject != identity_->subject || !identity->reaches(scene_->name())))
    return refuse({v1::ERROR_CODE_OUT_OF_ORDER,
                   "authenticate: a stream in a scene accepts only tokens of the same subject and tenant "
                   "that are valid for this scene"});
  if (!become(std::move(*identity))) return;
  if (scene_ != nullptr) scene_->roster.renew(*mailbox_, rightsIn(*scene_), now_);
  answer(reply);
}

std::optional<SharedBytes> Session::next() {
  return mailbox_->next(Clock::now());
}

bool Session::finished() const {
  return mailbox_->closed();
}

void Session::receive(std::span<const std::byte> bytes) {
  const Clock::time_point now = Clock::now();
  lastHeard_ = now;
  const std::lock_guard lock(mutex_);
  if (mailbox_->closed()) return;
  now_ = now;
  requestId_ = 0;
  readPause_ = readRate_.pay(now, static_cast<double>(bytes.size()));
  try {
    if (!allowed(messageRate_, "messages")) return;
    const messages::Result<v1::ClientMessage> message = messages::parseClientMessage(bytes);
    if (!message) return refuse(message.error(), kMalformedCost);
    requestId_ = message->request_id();
    dispatch(*message, now);
  } catch (const std::exception& failure) {
    // For example, memory ran out. That must end neither the endpoint's thread nor other sessions.
    spdlog::error("{}: a message failed: {}", peer_, failure.what());
    closeLocked(delivery::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                "the server could not handle the message; try again later", true, requestId_),
                DisconnectReason::lost);
  }
}

template <typename Response>
std::function<void(tl::expected<Response, v1::Error>)> Session::answering(
    Response* (v1::ServerMessage::*body)()) {
  ++asked_;
  return [weak = weak_from_this(), requestId = requestId_, body,
          counted = true](tl::expected<Response, v1::Error> response) mutable {
    const std::shared_ptr<Session> session = weak.lock();
    if (!session) return;
    const std::lock_guard lock(session->mutex_);
    // A call that throws is repeated.
    if (std::exchange(counted, false)) --session->asked_;
    if (session->mailbox_->closed()) return;
    session->now_ = Clock::now();
    session->requestId_ = requestId;
    if (!response) return session->refuse({response.error().code(), response.error().text()});
    v1::ServerMessage message;
    *(message.*body)() = std::move(*response);
    session->answer(message);
  };
}

void Session::dispatch(const v1::ClientMessage& message, Clock::time_point now) {
  using Body = v1::ClientMessage;
  const bool needsIdentity = message.body_case() != Body::kAuthenticate && message.body_case() != Body::kPing;
  if (needsIdentity && !identity_) {
    server_.metrics.refuse(telemetry::Refusal::token);
    return fail(v1::ERROR_CODE_UNAUTHENTICATED, whyUnknown_);
  }
  if (manage(message)) return;
  switch (message.body_case()) {
    case Body::kHello:
      return hello(message.hello());
    case Body::kPing: {
      if (!allowed(pingRate_, "pings")) return;
      v1::ServerMessage pong;
      pong.mutable_pong()->set_client_time_us(message.ping().client_time_us());
      pong.mutable_pong()->set_server_time_us(schedule::microseconds(now));
      return answer(pong);
    }
    case Body::kListScenes: {
      if (!allowed(queryRate_, "queries")) return;
      v1::ServerMessage list;
      *list.mutable_list_scenes() = server_.listScenes(*identity_);
      return answer(list);
    }
    case Body::kGetScene: {
      if (!allowed(queryRate_, "queries")) return;
      if (const auto may = server_.mayUse(*identity_, message.get_scene().name()); !may)
        return refuse(may.error());
      auto found = server_.getScene(message.get_scene(), kMaxAnswerBytes);
      if (!found && found.error().code() == v1::ERROR_CODE_RESOURCE_EXHAUSTED)
        server_.metrics.refuse(telemetry::Refusal::answerSize);
      if (!found) return refuse({found.error().code(), found.error().text()});
      v1::ServerMessage scene;
      *scene.mutable_get_scene() = std::move(*found);
      return answer(scene);
    }
    case Body::kUpload:
      if (const auto may = server_.mayCreate(*identity_); !may) return refuse(may.error());
      uploads_ = true;
      return refuseUnless(upload_.add(message.upload(), now));
    case Body::kCreateScene:
      return create(message.create_scene());
    case Body::kDeleteScene:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.delete_scene().name(), Action::deleteScene)) return;
      return refuseUnlessQueued(
          server_.maker.remove(message.delete_scene(),
                               answering<v1::DeleteSceneResponse>(&v1::ServerMessage::mutable_delete_scene)));
    case Body::kControlScene: {
      if (!allowed(controlRate_, "requests about scenes")) return;
      const auto participant = actor(message.control_scene().name(), Action::controlScene);
      if (!participant) return;
      auto controlled = server_.controlScene(message.control_scene(), *participant);
      if (!controlled) return refuse({controlled.error().code(), controlled.error().text()});
      v1::ServerMessage reply;
      *reply.mutable_control_scene() = std::move(*controlled);
      return answer(reply);
    }
    case Body::kStartRecording:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.start_recording().scene(), Action::recordScene)) return;
      return refuseUnlessQueued(server_.maker.startRecording(
          message.start_recording(),
          answering<v1::StartRecordingResponse>(&v1::ServerMessage::mutable_start_recording)));
    case Body::kStopRecording:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.stop_recording().scene(), Action::recordScene)) return;
      return refuseUnlessQueued(server_.maker.stopRecording(
          message.stop_recording(),
          answering<v1::StopRecordingResponse>(&v1::ServerMessage::mutable_stop_recording)));
    default:
      break;
  }
  if (scene_ == nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER, "this stream has not joined a scene: send hello first");

  switch (message.body_case()) {
    case Body::kColliderPoses:
      if (allowed(poseRate_, "collider poses")) poses(message.collider_poses(), now);
      return;
    case Body::kParameterChange:
      if (!allowed(changeRate_, "parameter changes")) return;
      return refuseUnless(
          scene_->roster.permits(*mailbox_, message.parameter_change(), server_.options.participantsMay)
              .and_then([&] { return scene_->change(participant_, message.parameter_change()); }));
    case Body::kSetRole:
      if (!allowed(controlRate_, "requests about participants")) return;
      return refuseUnless(scene_->roster.setRole(*mailbox_, message.set_role(), now));
    case Body::kRemoveParticipant:
      if (!allowed(controlRate_, "requests about participants")) return;
      return refuseUnless(scene_->roster.remove(*mailbox_, message.remove_participant(), now));
    case Body::kFrameAck:
      if (!mailbox_->acknowledge(message.frame_ack().tick(), now))
        refuse({v1::ERROR_CODE_INVALID_ARGUMENT,
                fmt::format("frame_ack.tick = {}: must be of a frame that was sent",
                            message.frame_ack().tick())});
      return;
    case Body::kKeyFrameRequest:
      if (!allowed(keyFrameRate_, "key frame requests")) return;
      return message.key_frame_request().early() ? mailbox_->requestKeyFrame() : mailbox_->restart();
    default:
      return refuse({v1::ERROR_CODE_MALFORMED_MESSAGE,
                     "the message has no body, or one that this server does not know"});
  }
}

bool Session::manage(const v1::ClientMessage& message) {
  using Body = v1::ClientMessage;
  const auto reply = [this](auto&& result, auto* (v1::ServerMessage::*body)()) {
    if (!result) return refuse(result.error());
    v1::ServerMessage answered;
    *(answered.*body)() = std::move(*result);
    answer(answered);
  };
  switch (message.body_case()) {
    case Body::kAuthenticate:
      if (allowed(controlRate_, "tokens")) authenticate(message.authenticate());
      return true;
    case Body::kCreatePairingCode:
      if (allowed(controlRate_, "requests about pairing"))
        reply(server_.createPairingCode(*identity_, message.create_pairing_code(), now_),
              &v1::ServerMessage::mutable_create_pairing_code);
      return true;
    case Body::kListBans:
      if (allowed(controlRate_, "requests about bans") &&
          actor(message.list_bans().scene(), Action::manageBans))
        reply(server_.listBans(message.list_bans()), &v1::ServerMessage::mutable_list_bans);
      return true;
    case Body::kLiftBan:
      if (allowed(controlRate_, "requests about bans") &&
          actor(message.lift_ban().scene(), Action::manageBans))
        reply(server_.liftBan(message.lift_ban()), &v1::ServerMessage::mutable_lift_ban);
      return true;
    default:
      return false;
  }
}

scene::Rights Session::rightsIn(const scene::LiveScene& scene) const {
  using scene::Ownership;
  if (identity_->role == scene::Role::viewer) return {.ownership = Ownership::never, .onlyViews = true};
  if (hosting::SceneServer::State::isOfOtherTenant(*identity_, scene)) return {.ownership = Ownership::never};
  if (identity_->isVerifiedOwner()) return {.ownership = Ownership::always};
  const bool mayOwn = identity_->role == scene::Role::owner || server_.options.participantsMay.own;
  return {.ownership = mayOwn ? Ownership::ifNone : Ownership::never};
}

void Session::hello(const v1::Hello& message) {
  if (scene_ != nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER,
                fmt::format("this stream has joined '{}' already: open another one", scene_->name()));
  v1::Hello request = message;
  if (!identity_->displayName.empty()) request.set_display_name(identity_->displayName);
  messages::Result<messages::Joining> joining = messages::toJoining(request, codec::kCodecs);
  if (!joining) return fail(joining.error().code, joining.error().text);
  if (joining->scene.empty()) joining->scene = identity_->scene;
  if (const auto may = server_.mayUse(*identity_, joining->scene); !may)
    return fail(server_.find(joining->scene) && identity_->reaches(joining->scene) ? v1::ERROR_CODE_REMOVED
                                                                                   : may.error().code,
                may.error().text);
  const std::shared_ptr<scene::LiveScene> scene = server_.find(joining->scene);
  if (!scene) {
    const v1::Error error = server_.noSuchScene(joining->scene, *identity_);
    return fail(error.code(), error.text());
  }
  if (const std::string why = scene->quarantined(); !why.empty())
    return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED, why);
  // All subscribers share one stream, which has one codec.
  if (std::ranges::find(message.codecs(), scene->codec()) == message.codecs().end())
    return fail(
        v1::ERROR_CODE_UNSUPPORTED_CODEC,
        fmt::format("hello.codecs: must contain {}, the codec of '{}'", scene->codec(), scene->name()));
  auto admission = scene->roster.join({.clientName = joining->clientName,
                                       .displayName = joining->displayName,
                                       .role = scene::fromMessage(joining->role),
                                       .token = message.resume_token(),
                                       .subject = identity_->subject,
                                       .rights = rightsIn(*scene),
                                       .attempt = message.attempt()},
                                      mailbox_, server_.participants, scene->maxParticipants, now_);
  if (!admission && admission.error() == scene::Roster::Refusal::closed)
    return fail(v1::ERROR_CODE_NOT_FOUND, fmt::format("'{}' was just closed", scene->name()));
  if (!admission && admission.error() == scene::Roster::Refusal::removed)
    return fail(v1::ERROR_CODE_REMOVED, fmt::format("an owner removed you from '{}'", scene->name()));
  if (!admission && admission.error() == scene::Roster::Refusal::late)
    return fail(v1::ERROR_CODE_TAKEN_OVER, "this participant has a newer connection");
  if (!admission) server_.metrics.refuse(telemetry::Refusal::participants);
  if (!admission)
    return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                fmt::format("'{}' has {} participants, its maximum; try again later", scene->name(),
                            scene->maxParticipants));
  scene_ = scene;
  participant_ = admission->id;
  scene->metrics.joins.add();
  const std::shared_ptr<const delivery::DescriptionChunks> description = scene->description();
  const bool known = admission->resumed && message.description_content_id() == description->contentId();

  v1::ServerMessage reply;
  v1::Welcome& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(joining->protocolVersion);
  welcome.set_codec(scene->codec());
  welcome.set_scene(scene->name());
  welcome.set_participant_id(participant_);
  welcome.set_server_name(server_.options.serverName);
  welcome.set_device_name(server_.deviceNameOf(*scene));
  welcome.set_description_content_id(description->contentId());
  welcome.set_role(scene::toMessage(admission->role));
  welcome.set_resume_token(admission->token);
  welcome.set_resumed(admission->resumed);
  for (const scene::Participant& participant : admission->participants)
    scene::write(participant, *welcome.add_participants());
  welcome.set_hold_ms(static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(server_.options.reconnectGrace.place).count()));
  answer(reply);
  mailbox_->subscribe(known ? nullptr : description, scene->shape(), scene->metrics,
                      {joining->quality, joining->temporalLayers});
  if (scene->paused) mailbox_->announce(scene::pausedNotice(*scene));
  if (!scene->source && scene->work.load() != scene->allWork())
    mailbox_->announce(scene::workNotice(*scene, scene->tick));
  if (scene->source) {
    mailbox_->announce(scene::playbackMessage(*scene->source));
    if (SharedBytes parameters = scene::parametersMessage(*scene->source, scene->tick))
      mailbox_->announce(std::move(parameters));
  }
  if (scene->journal && scene->journal->active()) mailbox_->announce(scene::recordingNotice(scene->tick));
  server_.wake(*scene);
  telemetry::log(
      {scene->name(), participant_}, spdlog::level::info, "{} {} as participant {}, {} ({}); {} in it", peer_,
      admission->resumed ? "came back" : "joined", participant_, scene::nameOf(admission->role),
      joining->clientName.empty() ? "unnamed client" : joining->clientName, scene->subscribers.size());
}

void Session::create(const v1::CreateSceneRequest& request) {
  if (!allowed(controlRate_, "requests about scenes")) return;
  if (const auto may = server_.mayCreate(*identity_); !may) return refuse(may.error());
  std::optional<hosting::UploadedContent> uploaded;
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
    messages::Result<hosting::UploadedContent> taken = upload_.take(request.uploaded_content_id());
    if (!taken) return refuse(taken.error());
    uploaded = std::move(*taken);
  }
  const auto wanted = [weak = weak_from_this()] {
    const std::shared_ptr<Session> session = weak.lock();
    return session && !session->mailbox_->closed();
  };
  refuseUnlessQueued(
      server_.maker.create(request, std::move(uploaded), identity_->subject.tenant, wanted,
                           answering<v1::CreateSceneResponse>(&v1::ServerMessage::mutable_create_scene)));
}

void Session::refuseUnlessQueued(const tl::expected<void, v1::Error>& queued) {
  if (queued) return;
  --asked_;
  refuse({queued.error().code(), queued.error().text()});
}

void Session::poses(const v1::ColliderPoses& message, Clock::time_point now) {
  if (scene_->source) return;  // a played recording has no inputs
  auto poses = messages::toPoses(message, scene_->start());
  if (!poses) return refuse(poses.error());
  refuseUnless(
      scene_->roster.post(*mailbox_, message, std::move(*poses), server_.options.participantsMay, now));
}

std::optional<std::uint64_t> Session::actor(const std::string& name, Action action) {
  const bool inside = scene_ != nullptr && server_.find(name) == scene_;
  const messages::Result<void> may =
      inside ? scene_->roster.permits(*mailbox_, action, server_.options.participantsMay)
             : server_.mayFromOutside(*identity_, name, action);
  if (may) return inside ? participant_ : 0;
  refuse(may.error());
  return std::nullopt;
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
  if (!offences_.take(now_, cost)) {
    server_.metrics.droppedConnections.add();
    return fail(reason.code, "too many refused messages; the last one: " + reason.text);
  }
  if (!errorRate_.take(now_)) return;
  v1::ServerMessage message;
  message.mutable_error()->set_code(reason.code);
  message.mutable_error()->set_text(reason.text);
  answer(message);
}

void Session::fail(v1::ErrorCode code, std::string text) {
  spdlog::info("{}: closed: {}", peer_, text);
  closeLocked(delivery::error(code, std::move(text), true, requestId_), DisconnectReason::removed);
}

bool Session::allowed(schedule::TokenBucket& bucket, const char* what) {
  if (bucket.take(now_)) return true;
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

void Session::checkSilence(Clock::time_point now) {
  const hosting::ServerOptions& options = server_.options;
  // This runs on a thread that publishes frames. A session that handles a message is not silent; the next
  // call checks it.
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  // A mailbox that others closed, such as the scene's roster, is noticed here too.
  if (mailbox_->closed()) {
    now_ = now;
    return disconnect(DisconnectReason::lost);
  }
  // A stream in a scene has some time to send a new token.
  const auto grace = scene_ ? identity::Authenticator::kExpiryGrace : std::chrono::seconds(0);
  if (const char* const why =
          identity_ && options.authenticator ? options.authenticator->whyEnded(*identity_, grace) : nullptr) {
    now_ = now;
    spdlog::info("{}: disconnected: {}", peer_, why);
    return closeLocked(delivery::error(v1::ERROR_CODE_UNAUTHENTICATED, why, true), DisconnectReason::lost);
  }
  requestId_ = 0;
  now_ = now;
  refuseUnless(upload_.checkPace({options.maxUploadTime, options.minUploadRate * kKilobyte}, now));
  if (now - lastHeard_.load() > options.silence)
    return cutOff(telemetry::Refusal::silence,
                  fmt::format("the client was silent for {} s: acknowledge frames, or send pings",
                              schedule::seconds(options.silence)));
  if (scene_ || asked_ > 0) return;
  const std::chrono::milliseconds time =
      options.helloTimeout + (uploads_ ? options.maxUploadTime : std::chrono::milliseconds(0));
  if (now - opened_ > time)
    cutOff(telemetry::Refusal::helloTimeout,
           fmt::format(
               "the client joined no scene within {} s: send hello soon after connecting (--hello-timeout)",
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
  // The owner's destructor calls this, so nothing may leave it. A lack of memory leaves the participant in
  // its scene until the next attempt.
  schedule::retryUntilDone(
      [&] { closeLocked(nullptr, DisconnectReason::lost); },
      [&](const std::exception& failure) { spdlog::error("{}: {}; trying again", peer_, failure.what()); });
  counted_.reset();
}

void Session::disconnect(DisconnectReason reason) {
  if (scene_ == nullptr) return;
  if (reason == DisconnectReason::lost)
    scene_->roster.disconnect(*mailbox_, server_.options.reconnectGrace, now_);
  else
    scene_->roster.leave(
        *mailbox_, reason == DisconnectReason::left ? scene::LeaveReason::left : scene::LeaveReason::removed,
        now_);
  server_.wake(*scene_);
  telemetry::log({scene_->name(), participant_}, spdlog::level::info, "{} {}; {} in it", peer_,
                 reason == DisconnectReason::lost ? "was disconnected" : "left", scene_->subscribers.size());
  scene_ = nullptr;
}

}  // namespace clothstream::session
