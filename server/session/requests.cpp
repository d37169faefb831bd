// SPDX-License-Identifier: MIT
// Requests of a peer.
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/mailbox.h"
#include "server/hosting/server_state.h"
#include "server/messages/client_message.h"
#include "server/session/session.h"

namespace clothstream::session {
namespace {

using scene::Action;

// Largest answer in a stream; it bounds the memory that a peer costs. Scenes with large meshes need the unary
// call.
constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;

}  // namespace

template <typename Response>
std::function<void(tl::expected<Response, v1::Error>)> Session::answering(
    Response* (v1::ServerMessage::*body)()) {
  ++asked_;
  return [weak = weak_from_this(), requestId = requestId_, body](tl::expected<Response, v1::Error> response) {
    const std::shared_ptr<Session> session = weak.lock();
    if (!session) return;
    const std::lock_guard lock(session->mutex_);
    --session->asked_;
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
  dispatchInScene(message, now);
}

void Session::dispatchInScene(const v1::ClientMessage& message, Clock::time_point now) {
  using Body = v1::ClientMessage;
  switch (message.body_case()) {
    case Body::kColliderPoses:
      if (allowed(poseRate_, "collider poses")) poses(message.collider_poses(), now);
      return;
    case Body::kParameterChange:
      if (!allowed(changeRate_, "parameter changes")) return;
      return refuseUnless(
          scene_->roster.permits(*mailbox_, message.parameter_change(), server_.options.participantsMay)
              .and_then([&] {
                return scene_->change(participant_, message.parameter_change(),
                                      scene_->roster.roleOf(*mailbox_));
              }));
    case Body::kSetRole:
      if (!allowed(controlRate_, "requests about participants")) return;
      return refuseUnless(scene_->roster.setRole(*mailbox_, message.set_role(), now));
    case Body::kRemoveParticipant:
      if (!allowed(controlRate_, "requests about participants")) return;
      return refuseUnless(scene_->roster.remove(*mailbox_, message.remove_participant(), now));
    case Body::kFrameAck:
      return acknowledge(message.frame_ack().tick(), now);
    case Body::kKeyFrameRequest:
      // A key frame costs all subscribers of its quality. The mailbox limits early requests.
      if (message.key_frame_request().early()) return mailbox_->requestKeyFrame();
      if (mailbox_->isRestarting()) return;
      // In lockstep the key frame is a recorded one, which costs nothing.
      if (!inLockstep() && !allowed(keyFrameRate_, "key frame requests")) return;
      mailbox_->restart();
      if (inLockstep()) server_.wake(*scene_);
      return;
    default:
      return refuse({v1::ERROR_CODE_MALFORMED_MESSAGE,
                     "the message has no body, or one that this server does not know"});
  }
}

bool Session::inLockstep() const {
  return scene_->source && scene_->source->inLockstep();
}

void Session::acknowledge(std::uint64_t tick, Clock::time_point now) {
  const bool awaited = mailbox_->awaitsAcknowledgement();
  // A peer that continues here may acknowledge frames of the server that had the scene before.
  if (!mailbox_->acknowledge(tick, now))
    return continues_ ? void()
                      : refuse({v1::ERROR_CODE_INVALID_ARGUMENT,
                                fmt::format("frame_ack.tick = {}: must be of a frame that was sent", tick)});
  if (!inLockstep() || !awaited || mailbox_->awaitsAcknowledgement()) return;
  // Each frame permits one such acknowledgement, so they need no other limit.
  messageRate_.giveBack();
  server_.wake(*scene_);
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
      scene_->poses.post(*mailbox_, message, std::move(*poses), server_.options.participantsMay, now));
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

}  // namespace clothstream::session
