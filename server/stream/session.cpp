// SPDX-License-Identifier: MIT
// What a peer says and how the server answers.
#include "server/stream/session.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "proto/codec/packet_header.h"
#include "server/messages/client_message.h"
#include "server/stream/server_state.h"

namespace clothstream::stream {
namespace {

constexpr double kMalformedCost = 60;
// Who does not read holds one of these at most: scenes with large meshes take more.
constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;

}  // namespace

Session::Session(SceneServer::State& server, std::string peer, std::function<void()> wake)
    : server_(server),
      peer_(std::move(peer)),
      mailbox_(std::make_shared<Mailbox>(std::move(wake))),
      lastHeard_(Clock::now()),
      upload_(server.uploads) {}

void Session::receive(std::span<const std::byte> bytes, Clock::time_point now) {
  lastHeard_ = now;
  const std::lock_guard lock(mutex_);
  if (mailbox_->closed()) return;
  now_ = now;
  requestId_ = 0;
  if (!allowed(messageRate_, "messages")) return;
  const messages::Result<v1::ClientMessage> message = messages::parseClientMessage(bytes);
  if (!message) return refuse(message.error(), kMalformedCost);
  requestId_ = message->request_id();
  dispatch(*message, now);
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
      pong.mutable_pong()->set_server_time_us(microseconds(now));
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
      auto found = server_.getScene(message.get_scene());
      if (!found) return refuse({found.error().code(), found.error().text()});
      v1::ServerMessage scene;
      *scene.mutable_get_scene() = std::move(*found);
      if (const std::size_t bytes = scene.ByteSizeLong(); bytes > kMaxAnswerBytes)
        return refuse({v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                       fmt::format("getScene: '{}' takes {} bytes, and a stream answers with {} at most: use "
                                   "the unary call",
                                   message.get_scene().name(), bytes, kMaxAnswerBytes)});
      return answer(scene);
    }
    case Body::kUpload:
      return upload(message.upload());
    case Body::kCreateScene:
      return create(message.create_scene());
    case Body::kDeleteScene:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.delete_scene().name(), Act::deleteScene)) return;
      return server_.maker.remove(message.delete_scene(), answering<v1::DeleteSceneResponse>(
                                                              &v1::ServerMessage::mutable_delete_scene));
    case Body::kControlScene: {
      if (!allowed(controlRate_, "requests about scenes")) return;
      const auto who = actor(message.control_scene().name(), Act::controlScene);
      if (!who) return;
      auto controlled = server_.controlScene(message.control_scene(), *who);
      if (!controlled) return refuse({controlled.error().code(), controlled.error().text()});
      v1::ServerMessage reply;
      *reply.mutable_control_scene() = std::move(*controlled);
      return answer(reply);
    }
    case Body::kStartRecording:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.start_recording().scene(), Act::recordScene)) return;
      return server_.maker.startRecording(
          message.start_recording(),
          answering<v1::StartRecordingResponse>(&v1::ServerMessage::mutable_start_recording));
    case Body::kStopRecording:
      if (!allowed(controlRate_, "requests about scenes")) return;
      if (!actor(message.stop_recording().scene(), Act::recordScene)) return;
      return server_.maker.stopRecording(
          message.stop_recording(),
          answering<v1::StopRecordingResponse>(&v1::ServerMessage::mutable_stop_recording));
    default:
      break;
  }
  if (scene_ == nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER, "this stream has joined no scene: send hello first");

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
      return message.key_frame_request().early() ? mailbox_->wantKeyFrame() : mailbox_->restart();
    default:
      return refuse({v1::ERROR_CODE_MALFORMED_MESSAGE, "the message has no body that this server knows"});
  }
}

void Session::hello(const v1::Hello& message) {
  if (scene_ != nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER,
                fmt::format("this stream has joined '{}' already: open another one", scene_->name()));
  const messages::Result<messages::Joining> joining = messages::toJoining(message, codec::kCodecs);
  if (!joining) return fail(joining.error().code, joining.error().text);
  const std::shared_ptr<LiveScene> scene = server_.find(joining->scene);
  if (!scene) {
    const v1::Error error = server_.noSuchScene(joining->scene);
    return fail(error.code(), error.text());
  }
  // One stream for all: it has one codec.
  if (std::ranges::find(message.codecs(), scene->codec()) == message.codecs().end())
    return fail(
        v1::ERROR_CODE_UNSUPPORTED_CODEC,
        fmt::format("hello.codecs: must have {}, in which '{}' is sent", scene->codec(), scene->name()));
  auto admission = scene->roster.join({.clientName = joining->clientName,
                                       .displayName = joining->displayName,
                                       .role = joining->role,
                                       .token = message.resume_token(),
                                       .attempt = message.attempt()},
                                      mailbox_, server_.participants, scene->maxParticipants, now_);
  if (!admission && admission.error() == Roster::Refusal::closed)
    return fail(v1::ERROR_CODE_NOT_FOUND, fmt::format("'{}' was just deleted", scene->name()));
  if (!admission && admission.error() == Roster::Refusal::late)
    return fail(v1::ERROR_CODE_TAKEN_OVER, "a later connection of this participant was here before");
  if (!admission)
    return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                fmt::format("'{}' has {} participants, as many as it may have; try again later",
                            scene->name(), scene->maxParticipants));
  scene_ = scene;
  participant_ = admission->id;
  scene->metrics.joins.add();
  const std::shared_ptr<const Description> description = scene->description();
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
  welcome.set_role(admission->role);
  welcome.set_resume_token(admission->token);
  welcome.set_resumed(admission->resumed);
  welcome.mutable_participants()->Assign(admission->participants.begin(), admission->participants.end());
  welcome.set_hold_ms(static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(server_.options.holding.hold).count()));
  answer(reply);
  mailbox_->subscribe(known ? nullptr : description, scene->shape(), scene->metrics,
                      {joining->quality, joining->temporalLayers});
  if (scene->paused && !mailbox_->announce(pausedNotice(*scene)))
    return closeLocked(tooSlow(), Parting::lost);
  if (scene->source) {
    const SharedBytes parameters = parametersMessage(*scene->source, scene->tick);
    if (!mailbox_->announce(playbackMessage(*scene->source)) ||
        (parameters && !mailbox_->announce(parameters)))
      return closeLocked(tooSlow(), Parting::lost);
  }
  if (scene->journal && scene->journal->active() && !mailbox_->announce(recordedNotice(scene->tick)))
    return closeLocked(tooSlow(), Parting::lost);
  server_.wake(*scene);
  spdlog::info("{}: {} {} as participant {}, {} ({}); {} in it", scene->name(), peer_,
               admission->resumed ? "came back" : "joined", participant_, nameOf(admission->role),
               joining->clientName.empty() ? "unnamed client" : joining->clientName, scene->audience.size());
}

void Session::upload(const v1::Chunk& chunk) {
  if (const auto added = upload_.add(chunk); !added) refuse(added.error());
}

void Session::create(const v1::CreateSceneRequest& request) {
  if (!allowed(controlRate_, "requests about scenes")) return;
  std::optional<UploadedContent> uploaded;
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
    messages::Result<UploadedContent> taken = upload_.take(request.uploaded_content_id());
    if (!taken) return refuse(taken.error());
    uploaded = std::move(*taken);
  }
  server_.maker.create(request, std::move(uploaded),
                       answering<v1::CreateSceneResponse>(&v1::ServerMessage::mutable_create_scene));
}

void Session::poses(const v1::ColliderPoses& message, Clock::time_point now) {
  if (scene_->source) return;  // nothing in it can be touched
  auto poses = messages::toPoses(message, scene_->start());
  if (!poses) return refuse(poses.error());
  refuseUnless(
      scene_->roster.post(*mailbox_, message, std::move(*poses), server_.options.participantsMay, now));
}

std::optional<std::uint64_t> Session::actor(const std::string& name, Act act) {
  const bool inside = scene_ != nullptr && server_.find(name) == scene_;
  const messages::Result<void> may =
      inside ? scene_->roster.permits(*mailbox_, act, server_.options.participantsMay)
             : server_.mayFromOutside(name, act);
  if (may) return inside ? participant_ : 0;
  refuse(may.error());
  return std::nullopt;
}

void Session::answer(v1::ServerMessage& message) {
  message.set_request_id(requestId_);
  if (mailbox_->reply(serialise(message))) return;
  server_.metrics.droppedConnections.add();
  spdlog::warn("{}: does not read what it asks for; cut off", peer_);
  closeLocked(tooSlow(), Parting::lost);
}

void Session::refuseUnless(const messages::Result<void>& done) {
  if (!done) refuse(done.error());
}

void Session::refuse(const messages::FieldError& reason, double cost) {
  (scene_ != nullptr ? scene_->metrics.rejectedMessages : server_.metrics.rejectedMessages).add();
  spdlog::debug("{}: refused: {}", peer_, reason.text);
  if (!offences_.take(now_, cost)) {
    server_.metrics.droppedConnections.add();
    return fail(reason.code, "too many refused messages, at last: " + reason.text);
  }
  if (!errorRate_.take(now_)) return;
  v1::ServerMessage message;
  message.mutable_error()->set_code(reason.code);
  message.mutable_error()->set_text(reason.text);
  answer(message);
}

void Session::fail(v1::ErrorCode code, std::string text) {
  spdlog::info("{}: closed: {}", peer_, text);
  closeLocked(error(code, std::move(text), true, requestId_), Parting::removed);
}

bool Session::allowed(TokenBucket& bucket, const char* what) {
  if (bucket.take(now_)) return true;
  refuse({v1::ERROR_CODE_RATE_LIMITED, fmt::format("too many {}: the last one was ignored", what)});
  return false;
}

void Session::close(SharedBytes last) {
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(std::move(last), Parting::left);
}

void Session::closeLocked(SharedBytes last, Parting how) {
  mailbox_->close(std::move(last));
  part(how);
}

void Session::leave() {
  close(nullptr);
}

void Session::checkSilence(Clock::time_point now) {
  // A mailbox that its scene's audience closed, for want of room, is noticed here too.
  const bool silent = now - lastHeard_.load() > server_.options.silence;
  if (!silent && !mailbox_->closed()) return;
  const std::lock_guard lock(mutex_);
  now_ = now;
  if (!mailbox_->closed()) {
    server_.metrics.droppedConnections.add();
    const std::string text = fmt::format("nothing was heard for {} s: acknowledge frames, or send pings",
                                         seconds(server_.options.silence));
    spdlog::info("{}: cut off: {}", peer_, text);
    mailbox_->close(error(v1::ERROR_CODE_CUT_OFF, text, true));
  }
  part(Parting::lost);
}

void Session::end() {
  mailbox_->silence();
  const std::lock_guard lock(mutex_);
  now_ = Clock::now();
  closeLocked(nullptr, Parting::lost);
}

void Session::part(Parting how) {
  if (scene_ == nullptr) return;
  if (how == Parting::lost)
    scene_->roster.lose(*mailbox_, server_.options.holding, now_);
  else
    scene_->roster.leave(*mailbox_, how == Parting::left ? v1::LEAVE_REASON_LEFT : v1::LEAVE_REASON_REMOVED,
                         now_);
  server_.wake(*scene_);
  spdlog::info("{}: {} {}; {} in it", scene_->name(), peer_, how == Parting::lost ? "was cut off" : "left",
               scene_->audience.size());
  scene_ = nullptr;
}

}  // namespace clothstream::stream
