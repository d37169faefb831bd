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
#include "server/messages/client_message.h"
#include "server/telemetry/log.h"

namespace clothstream::session {
namespace {

using delivery::Mailbox;
using delivery::SharedBytes;
using scene::Action;

constexpr double kMalformedCost = 60;
// Largest answer in a stream; it bounds the memory that a peer costs. Scenes with large meshes need the unary
// call.
constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;

}  // namespace

Session::Session(hosting::SceneServer::State& server, std::string peer, std::function<void()> wake)
    : server_(server),
      peer_(std::move(peer)),
      mailbox_(std::make_shared<Mailbox>(std::move(wake))),
      lastHeard_(Clock::now()),
      upload_(server.uploads) {}

std::shared_ptr<Session> Session::open(hosting::SceneServer& server, std::string peer,
                                       std::function<void()> wake) {
  std::shared_ptr<Session> session(new Session(server.state(), std::move(peer), std::move(wake)));
  if (SharedBytes refusal = server.state().admit(session)) session->close(std::move(refusal));
  // The server and pending answers may keep the session alive for a moment. Only the endpoint's pointer ends
  // it.
  return {session.get(), [session](Session*) mutable {
            session->end();
            session.reset();
          }};
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
  if (!allowed(messageRate_, "messages")) return;
  try {
    const messages::Result<v1::ClientMessage> message = messages::parseClientMessage(bytes);
    if (!message) return refuse(message.error(), kMalformedCost);
    requestId_ = message->request_id();
    dispatch(*message, now);
  } catch (const std::exception& failure) {
    // For example, memory ran out. That must end neither the endpoint's thread nor other sessions.
    spdlog::error("{}: a message failed: {}", peer_, failure.what());
    fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED, "the server could not handle the message; try again later");
  }
}

template <typename Response>
std::function<void(tl::expected<Response, v1::Error>)> Session::answering(
    Response* (v1::ServerMessage::*body)()) {
  return [weak = weak_from_this(), requestId = requestId_, body](tl::expected<Response, v1::Error> response) {
    const std::shared_ptr<Session> session = weak.lock();
    if (!session) return;
    const std::lock_guard lock(session->mutex_);
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
      if (!allowed(queryRate_, "questions")) return;
      v1::ServerMessage list;
      *list.mutable_list_scenes() = server_.listScenes();
      return answer(list);
    }
    case Body::kGetScene: {
      if (!allowed(queryRate_, "questions")) return;
      auto found = server_.getScene(message.get_scene(), kMaxAnswerBytes);
      if (!found) return refuse({found.error().code(), found.error().text()});
      v1::ServerMessage scene;
      *scene.mutable_get_scene() = std::move(*found);
      return answer(scene);
    }
    case Body::kUpload:
      return refuseUnless(upload_.add(message.upload()));
    case Body::kCreateScene:
      return create(message.create_scene());
    case Body::kDeleteScene:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.delete_scene().name(), Action::deleteScene)) return;
      return server_.maker.remove(message.delete_scene(), answering<v1::DeleteSceneResponse>(
                                                              &v1::ServerMessage::mutable_delete_scene));
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
      return server_.maker.startRecording(
          message.start_recording(),
          answering<v1::StartRecordingResponse>(&v1::ServerMessage::mutable_start_recording));
    case Body::kStopRecording:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.stop_recording().scene(), Action::recordScene)) return;
      return server_.maker.stopRecording(
          message.stop_recording(),
          answering<v1::StopRecordingResponse>(&v1::ServerMessage::mutable_stop_recording));
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

void Session::hello(const v1::Hello& message) {
  if (scene_ != nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER,
                fmt::format("this stream has joined '{}' already: open another one", scene_->name()));
  const messages::Result<messages::Joining> joining = messages::toJoining(message, codec::kCodecs);
  if (!joining) return fail(joining.error().code, joining.error().text);
  const std::shared_ptr<scene::LiveScene> scene = server_.find(joining->scene);
  if (!scene) {
    const v1::Error error = server_.noSuchScene(joining->scene);
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
                                       .attempt = message.attempt()},
                                      mailbox_, server_.participants, scene->maxParticipants, now_);
  if (!admission && admission.error() == scene::Roster::Refusal::closed)
    return fail(v1::ERROR_CODE_NOT_FOUND, fmt::format("'{}' was just closed", scene->name()));
  if (!admission && admission.error() == scene::Roster::Refusal::late)
    return fail(v1::ERROR_CODE_TAKEN_OVER, "this participant has a newer connection");
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
  if (scene->paused && !mailbox_->announce(scene::pausedNotice(*scene)))
    return closeLocked(delivery::tooSlow(), DisconnectReason::lost);
  if (scene->source) {
    const SharedBytes parameters = scene::parametersMessage(*scene->source, scene->tick);
    if (!mailbox_->announce(scene::playbackMessage(*scene->source)) ||
        (parameters && !mailbox_->announce(parameters)))
      return closeLocked(delivery::tooSlow(), DisconnectReason::lost);
  }
  if (scene->journal && scene->journal->active() && !mailbox_->announce(scene::recordingNotice(scene->tick)))
    return closeLocked(delivery::tooSlow(), DisconnectReason::lost);
  server_.wake(*scene);
  telemetry::log(
      {scene->name(), participant_}, spdlog::level::info, "{} {} as participant {}, {} ({}); {} in it", peer_,
      admission->resumed ? "came back" : "joined", participant_, scene::nameOf(admission->role),
      joining->clientName.empty() ? "unnamed client" : joining->clientName, scene->subscribers.size());
}

void Session::create(const v1::CreateSceneRequest& request) {
  if (!allowed(controlRate_, "requests about scenes")) return;
  std::optional<hosting::UploadedContent> uploaded;
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
    messages::Result<hosting::UploadedContent> taken = upload_.take(request.uploaded_content_id());
    if (!taken) return refuse(taken.error());
    uploaded = std::move(*taken);
  }
  const auto accepted =
      server_.maker.create(request, std::move(uploaded),
                           answering<v1::CreateSceneResponse>(&v1::ServerMessage::mutable_create_scene));
  if (!accepted) refuse({accepted.error().code(), accepted.error().text()});
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
             : server_.mayFromOutside(name, action);
  if (may) return inside ? participant_ : 0;
  refuse(may.error());
  return std::nullopt;
}

void Session::answer(v1::ServerMessage& message) {
  message.set_request_id(requestId_);
  if (mailbox_->reply(delivery::serialise(message))) return;
  server_.metrics.droppedConnections.add();
  spdlog::warn("{}: does not read its answers; disconnected", peer_);
  closeLocked(delivery::tooSlow(), DisconnectReason::lost);
}

void Session::refuseUnless(const messages::Result<void>& done) {
  if (!done) refuse(done.error());
}

void Session::refuse(const messages::FieldError& reason, double cost) {
  (scene_ != nullptr ? scene_->metrics.rejectedMessages : server_.metrics.rejectedMessages).add();
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
  refuse({v1::ERROR_CODE_RATE_LIMITED, fmt::format("too many {}: this one was ignored", what)});
  return false;
}

void Session::close(SharedBytes last) {
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(std::move(last), DisconnectReason::left);
}

void Session::closeLocked(SharedBytes last, DisconnectReason reason) {
  mailbox_->close(std::move(last));
  disconnect(reason);
}

void Session::leave() {
  close(nullptr);
}

void Session::checkSilence(Clock::time_point now) {
  // A mailbox without room, which the scene's subscribers closed, is noticed here too.
  const hosting::ServerOptions& options = server_.options;
  const std::chrono::milliseconds beforeHello = std::min(options.helloTimeout, options.silence);
  const Clock::duration silence = now - lastHeard_.load();
  if (silence <= beforeHello && !mailbox_->closed()) return;
  const std::lock_guard lock(mutex_);
  const std::chrono::milliseconds allowed = scene_ ? options.silence : beforeHello;
  if (silence <= allowed && !mailbox_->closed()) return;
  now_ = now;
  if (!mailbox_->closed()) {
    server_.metrics.droppedConnections.add();
    const std::string text =
        fmt::format("the client was silent for {} s: {}", schedule::seconds(allowed),
                    scene_ ? "acknowledge frames, or send pings" : "send hello soon after connecting");
    spdlog::info("{}: disconnected: {}", peer_, text);
    mailbox_->close(delivery::error(v1::ERROR_CODE_CUT_OFF, text, true));
  }
  disconnect(DisconnectReason::lost);
}

void Session::end() {
  mailbox_->silence();
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(nullptr, DisconnectReason::lost);
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
