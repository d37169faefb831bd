// SPDX-License-Identifier: MIT
// Identity of a peer, and its way into a scene.
#include <algorithm>
#include <chrono>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "server/delivery/mailbox.h"
#include "server/hosting/scene_server.h"
#include "server/messages/client_message.h"
#include "server/scene/remote_session.h"
#include "server/scene/shared_surfaces.h"
#include "server/session/session.h"
#include "server/telemetry/log.h"

namespace clothstream::session {

void Session::identify(const std::string& token) {
  const std::lock_guard lock(mutex_);
  if (mailbox_->closed()) return;
  now_ = Clock::now();
  messages::Result<identity::Identity> identity = server_.authentication.identify(token, address_.empty());
  if (identity)
    become(std::move(*identity), token);
  else if (token.empty())
    whyUnknown_ = identity.error().text;
  else
    fail(identity.error().code, identity.error().text);
}

bool Session::become(identity::Identity identity, const std::string& token) {
  if (identity_.set(std::move(identity), token)) return true;
  fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
       fmt::format("your token has {} open connections, its maximum (--profile)",
                   server_.options.maxConnectionsPerToken));
  return false;
}

void Session::authenticate(const v1::AuthenticateRequest& request) {
  v1::ServerMessage reply;
  messages::Result<identity::Identity> identity =
      server_.authentication.authenticate(request, address_, now_, *reply.mutable_authenticate());
  if (!identity && scene_ != nullptr) return refuse(identity.error());
  if (!identity) return fail(identity.error().code, identity.error().text);
  if (scene_ != nullptr && identity->verified &&
      (identity->subject != identity_->subject || !identity->reaches(scene_->name())))
    return refuse({v1::ERROR_CODE_OUT_OF_ORDER,
                   "authenticate: a stream in a scene accepts only tokens of the same subject and tenant "
                   "that are valid for this scene"});
  const std::string& newToken = reply.authenticate().token();
  if (!become(std::move(*identity), newToken.empty() ? request.token() : newToken)) return;
  if (scene_ != nullptr) scene_->roster.renew(*mailbox_, rightsIn(*scene_), now_);
  answer(reply);
}

scene::Rights Session::rightsIn(const scene::LiveScene& scene) const {
  using scene::Ownership;
  if (identity_->role == scene::Role::viewer || (scene.source && scene.source->onlyViewed()))
    return {.ownership = Ownership::never, .onlyViews = true};
  if (hosting::Access::isOfOtherTenant(*identity_, scene)) return {.ownership = Ownership::never};
  if (identity_->isVerifiedOwner()) return {.ownership = Ownership::always};
  const bool mayOwn = identity_->role == scene::Role::owner || server_.options.participantsMay.own;
  return {.ownership = mayOwn ? Ownership::ifNone : Ownership::never};
}

std::shared_ptr<scene::LiveScene> Session::sceneOf(const v1::Hello& message,
                                                   const messages::Joining& joining) {
  const auto refused = [&](v1::ErrorCode code, std::string text) {
    const bool mayBeElsewhere = code == v1::ERROR_CODE_NOT_FOUND && identity_->reaches(joining.scene);
    fail(code, std::move(text),
         mayBeElsewhere ? server_.scenes.otherServerOf(joining.scene).value_or("") : std::string());
    return nullptr;
  };
  if (const auto may = server_.access.mayUse(*identity_, joining.scene); !may)
    return refused(server_.scenes.find(joining.scene) && identity_->reaches(joining.scene)
                       ? v1::ERROR_CODE_REMOVED
                       : may.error().code,
                   may.error().text);
  std::shared_ptr<scene::LiveScene> scene = server_.scenes.find(joining.scene);
  if (!scene) {
    const v1::Error error = server_.scenes.noSuchScene(joining.scene, *identity_);
    return refused(error.code(), error.text());
  }
  if (const std::string why = scene->quarantined(); !why.empty())
    return refused(v1::ERROR_CODE_RESOURCE_EXHAUSTED, why);
  // All subscribers share one stream, which has one codec.
  if (std::ranges::find(message.codecs(), scene->codec()) == message.codecs().end())
    return refused(v1::ERROR_CODE_UNSUPPORTED_CODEC,
                   fmt::format("hello.codecs: must contain {}, the codec of '{}'; update the client",
                               scene->codec(), scene->name()));
  return scene;
}

void Session::failToJoin(scene::Roster::Refusal refusal, const scene::LiveScene& scene) {
  using Refusal = scene::Roster::Refusal;
  switch (refusal) {
    case Refusal::closed:
      if (std::string why = scene.quarantined(); !why.empty())
        return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED, std::move(why));
      return fail(v1::ERROR_CODE_NOT_FOUND,
                  fmt::format("'{}' was just deleted, or has expired without participants: create it again",
                              scene.name()));
    case Refusal::removed:
      return fail(v1::ERROR_CODE_REMOVED, fmt::format("an owner removed you from '{}'", scene.name()));
    case Refusal::late:
      return fail(v1::ERROR_CODE_TAKEN_OVER, "this participant has a newer connection");
    case Refusal::addressHasMany:
      server_.metrics.refuse(telemetry::Refusal::participants);
      return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                  fmt::format("'{}' has {} participants from your address, its maximum "
                              "(--profile); try again later",
                              scene.name(), server_.options.placesOfAddress()));
    case Refusal::full:
      server_.metrics.refuse(telemetry::Refusal::participants);
      return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                  fmt::format("'{}' has {} participants, its maximum; try again later", scene.name(),
                              scene.terms.maxParticipants));
  }
}

void Session::welcome(const scene::Roster::Admission& admission, const messages::Joining& joining,
                      std::uint64_t description) {
  v1::ServerMessage reply;
  v1::Welcome& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(joining.protocolVersion);
  welcome.set_codec(scene_->codec());
  welcome.set_scene(scene_->name());
  welcome.set_participant_id(participant_);
  welcome.set_server_name(server_.options.serverName);
  welcome.set_device_name(server_.deviceNameOf(*scene_));
  welcome.set_description_content_id(description);
  welcome.set_role(scene::toMessage(admission.role));
  welcome.set_resume_token(admission.token);
  welcome.set_resumed(admission.resumed);
  for (const scene::Participant& participant : admission.participants)
    scene::write(participant, *welcome.add_participants());
  welcome.set_hold_ms(static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(server_.options.reconnectGrace.place).count()));
  welcome.set_acknowledge_every_frame(scene_->shape().lockstep);
  *welcome.mutable_surfaces() = surfaceLimits();
  answer(reply);
}

void Session::tellPresentState(scene::LiveScene& scene) {
  if (scene.paused) mailbox_->announce(scene::pausedNotice(scene));
  if (!scene.source && scene.work.load() != scene.allWork())
    mailbox_->announce(scene::workNotice(scene, scene.tick));
  if (surfaceLimits().policy() == v1::SURFACE_POLICY_EVERYONE && !mailbox_->atEdge()) {
    std::uint64_t none = 0;
    if (delivery::SharedBytes list = scene::surfaceList(scene.surfaces, none))
      mailbox_->announce(std::move(list));
  }
  if (scene.source) {
    if (delivery::SharedBytes playback = scene::playbackMessage(*scene.source))
      mailbox_->announce(std::move(playback));
    if (delivery::SharedBytes parameters = scene::parametersMessage(*scene.source, scene.tick))
      mailbox_->announce(std::move(parameters));
  }
  if (scene.journal && scene.journal->active()) mailbox_->announce(scene::recordingNotice(scene.tick));
}

bool Session::joinRemotely(const v1::Hello& message, const messages::Joining& joining,
                           const std::shared_ptr<scene::LiveScene>& scene) {
  const bool onlyViews = identity_->role == scene::Role::viewer || joining.role == v1::ROLE_VIEWER;
  if (!scene->source || onlyViews || scene->roster.knows(message.resume_token())) return false;
  // Messages of the other server come before the last one of this mailbox.
  std::shared_ptr<scene::RemoteSession> remote = scene->source->connect(
      {.name = peer_, .address = address_, .token = identity_.token(), .resumeToken = message.resume_token()},
      [mailbox = mailbox_] { mailbox->wake(); });
  if (!remote) return false;
  v1::ClientMessage first;
  first.set_request_id(requestId_);
  *first.mutable_hello() = message;
  first.mutable_hello()->set_scene(scene->name());
  const std::string bytes = first.SerializeAsString();
  if (!remote->send(std::as_bytes(std::span(bytes)))) return false;
  {
    const std::lock_guard lock(remoteMutex_);
    remote_ = std::move(remote);
  }
  mailbox_->wake();  // its first messages may be there already
  telemetry::log({scene->name()}, spdlog::level::info, "{} takes part through this server", peer_);
  return true;
}

void Session::hello(const v1::Hello& message) {
  v1::Hello request = message;
  if (!identity_->displayName.empty()) request.set_display_name(identity_->displayName);
  messages::Result<messages::Joining> joining = messages::toJoining(request, codec::kCodecs);
  if (!joining) return fail(joining.error().code, joining.error().text);
  if (joining->scene.empty()) joining->scene = identity_->scene;
  const std::shared_ptr<scene::LiveScene> scene = sceneOf(message, *joining);
  if (!scene || joinRemotely(request, *joining, scene)) return;
  auto admission =
      scene->roster.join({.clientName = joining->clientName,
                          .displayName = joining->displayName,
                          .role = scene::fromMessage(joining->role),
                          .token = message.resume_token(),
                          .subject = identity_->subject,
                          .rights = rightsIn(*scene),
                          .attempt = message.attempt(),
                          .address = address_,
                          .placesOfAddress = server_.options.placesOfAddress()},
                         mailbox_, server_.newestParticipant, scene->terms.maxParticipants, now_);
  if (!admission) return failToJoin(admission.error(), *scene);
  scene_ = scene;
  participant_ = admission->id;
  // A scene that was stopped since sceneOf() may have dismissed its participants before this one joined.
  if (std::string why = scene->quarantined(); !why.empty())
    return fail(v1::ERROR_CODE_RESOURCE_EXHAUSTED, std::move(why));
  scene->metrics.joins.add();
  if (continues_ && !admission->resumed)
    return fail(v1::ERROR_CODE_CUT_OFF, "the scene has moved to another server: join again");
  const std::shared_ptr<const delivery::DescriptionChunks> description = scene->description();
  const bool known =
      continues_ || (admission->resumed && message.description_content_id() == description->contentId());
  if (!continues_) welcome(*admission, *joining, description->contentId());
  mailbox_->subscribe(known ? nullptr : description, scene->shape(), scene->metrics, joining->quality);
  tellPresentState(*scene);
  server_.device.wake(*scene);
  telemetry::log(
      {scene->name(), participant_}, spdlog::level::info, "{} {} as participant {}, {} ({}); {} in it", peer_,
      admission->resumed ? "came back" : "joined", participant_, scene::nameOf(admission->role),
      joining->clientName.empty() ? "unnamed client" : joining->clientName, scene->subscribers.size());
}

}  // namespace clothstream::session
