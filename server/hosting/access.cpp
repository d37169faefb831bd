// SPDX-License-Identifier: MIT
// What peers may do to scenes, by their identity.
#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "proto/text/printable.h"
#include "server/hosting/server_state.h"
#include "server/identity/authenticator.h"

namespace clothstream::hosting {
namespace {

tl::unexpected<messages::FieldError> denied(v1::ErrorCode code, std::string text) {
  return tl::unexpected(messages::FieldError{code, std::move(text)});
}

}  // namespace

messages::Result<Identity> SceneServer::State::identify(const std::string& token, bool isLoopback) {
  if (!options.authenticator) return identity::local();
  messages::Result<Identity> identity = token.empty() ? options.authenticator->anonymous(isLoopback)
                                                      : options.authenticator->verify(token, isLoopback);
  // A browser can send its token only after it has connected.
  if (!identity && !token.empty()) metrics.refuse(telemetry::Refusal::token);
  return identity;
}

messages::Result<Identity> SceneServer::State::authenticate(const v1::AuthenticateRequest& request,
                                                            const std::string& address, Clock::time_point now,
                                                            v1::AuthenticateResponse& response) {
  const auto answer = [&](messages::Result<Identity> identity) {
    if (!identity) return identity;
    response.set_role(scene::toMessage(identity->role));
    response.set_scene(identity->scene);
    if (identity->expires)
      response.set_expires_s(static_cast<std::uint64_t>(
          std::chrono::duration_cast<std::chrono::seconds>(identity->expires->time_since_epoch()).count()));
    return identity;
  };
  const bool isRequired = options.authenticator && options.authenticator->required();
  if (!isRequired || request.proof_case() != v1::AuthenticateRequest::kPairingCode)
    return answer(identify(request.token(), address.empty()));
  auto paired = options.authenticator->pair(request.pairing_code(), address, now);
  if (!paired) {
    metrics.refuse(telemetry::Refusal::pairingCode);
    return tl::unexpected(std::move(paired).error());
  }
  response.set_token(paired->token);
  return answer(std::move(paired->identity));
}

std::shared_ptr<const void> SceneServer::State::countConnection(const Identity& identity) {
  static const int uncounted = 0;
  if (!identity.verified) return {std::shared_ptr<const void>(), &uncounted};
  auto release = [this, subject = identity.subject](const void*) {
    const std::lock_guard lock(mutex);
    const auto known = connectionsOfSubjects.find(subject);
    if (--known->second == 0) connectionsOfSubjects.erase(known);
  };
  {
    const std::lock_guard lock(mutex);
    std::uint32_t& count = connectionsOfSubjects[identity.subject];
    if (count >= options.maxConnectionsPerToken) {
      metrics.refuse(telemetry::Refusal::connectionsOfToken);
      return nullptr;
    }
    ++count;
  }
  return {&uncounted, std::move(release)};
}

std::uint32_t SceneServer::State::scenesPerTenant() const {
  constexpr std::uint32_t kTenants = 4;  // with the default, this many tenants can fill the server
  if (options.maxScenesPerTenant) return *options.maxScenesPerTenant;
  const bool hasTenants = options.authenticator && options.authenticator->hasTenants();
  return hasTenants ? std::max(1U, options.maxCreatedScenes / kTenants) : options.maxCreatedScenes;
}

bool SceneServer::State::isOfOtherTenant(const Identity& by, const scene::LiveScene& scene) {
  return by.verified && scene.created && scene.tenant != by.subject.tenant;
}

messages::Result<void> SceneServer::State::mayUse(const Identity& by, const std::string& name) const {
  const std::string& meant = name.empty() ? options.defaultScene : name;
  if (!by.reaches(meant))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("'{:.64}': your token is only for the scene '{:.64}'", printable(meant),
                              printable(by.scene)));
  const std::shared_ptr<scene::LiveScene> scene = find(name);
  if (!scene) return denied(v1::ERROR_CODE_NOT_FOUND, noSuchScene(name, by).text());
  if (by.verified && scene->roster.isBanned(by.subject))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("an owner banned you from the scene '{}'", scene->name()));
  return {};
}

messages::Result<void> SceneServer::State::mayCreate(const Identity& by) const {
  if (!by.scene.empty())
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("createScene: your token is only for the scene '{:.64}'", printable(by.scene)));
  return scene::permit(by.role, scene::Action::createScene, options.participantsMay);
}

messages::Result<void> SceneServer::State::mayFromOutside(const Identity& by, const std::string& name,
                                                          scene::Action action) const {
  if (auto may = mayUse(by, name); !may) return may;
  const std::shared_ptr<scene::LiveScene> scene = find(name);
  if (scene && isOfOtherTenant(by, *scene))
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  fmt::format("the scene '{}' belongs to another tenant than your token", scene->name()));
  if (by.isVerifiedOwner()) return {};
  // Without identities, every program that reaches a scene without an owner may act as one.
  const bool actsAsOwner =
      by.role == scene::Role::owner && (options.outsideControl || !scene || !scene->roster.owned());
  if (actsAsOwner) return {};
  const scene::Role role = by.role == scene::Role::owner ? scene::Role::none : by.role;
  messages::Result<void> permitted = scene::permit(role, action, options.participantsMay);
  if (!permitted && role == scene::Role::none && scene)
    permitted.error().text += fmt::format(", because you are not in the scene '{}'", scene->name());
  return permitted;
}

messages::Result<v1::CreatePairingCodeResponse> SceneServer::State::createPairingCode(
    const Identity& by, const v1::CreatePairingCodeRequest& request, Clock::time_point now) {
  if (!options.authenticator || !options.authenticator->pairs())
    return denied(v1::ERROR_CODE_INVALID_ARGUMENT,
                  "createPairingCode: this server does not pair; start it with --pairing");
  if (!by.isVerifiedOwner() || !by.scene.empty())
    return denied(v1::ERROR_CODE_PERMISSION_DENIED,
                  "createPairingCode: requires a token with the role owner for all scenes");
  // Streams continue for some time after their token has expired, but a code made then would outlive it.
  if (const char* const why = options.authenticator->whyEnded(by, std::chrono::seconds(0)))
    return denied(v1::ERROR_CODE_UNAUTHENTICATED, fmt::format("createPairingCode: {}", why));
  if (request.role() < v1::ROLE_UNSPECIFIED || request.role() > v1::ROLE_OWNER)
    return denied(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("createPairingCode.role = {}: must be ROLE_VIEWER, ROLE_PARTICIPANT or ROLE_OWNER",
                    static_cast<int>(request.role())));
  const scene::Role role =
      request.role() == v1::ROLE_UNSPECIFIED ? scene::Role::participant : scene::fromMessage(request.role());
  const auto made = options.authenticator->makeCode(role, now);
  if (!made) return tl::unexpected(made.error());
  v1::CreatePairingCodeResponse response;
  response.set_code(made->code);
  response.set_role(scene::toMessage(made->role));
  response.set_valid_s(
      static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::seconds>(made->ends - now).count()));
  return response;
}

messages::Result<v1::ListBansResponse> SceneServer::State::listBans(
    const v1::ListBansRequest& request) const {
  const std::shared_ptr<scene::LiveScene> scene = find(request.scene());
  if (!scene) {
    const v1::Error error = noSuchScene(request.scene());
    return denied(error.code(), error.text());
  }
  v1::ListBansResponse response;
  for (const scene::Ban& ban : scene->roster.bans()) {
    v1::Ban& listed = *response.add_bans();
    listed.set_subject(ban.subject.name);
    listed.set_tenant(ban.subject.tenant);
    listed.set_display_name(ban.displayName);
  }
  return response;
}

messages::Result<v1::LiftBanResponse> SceneServer::State::liftBan(const v1::LiftBanRequest& request) {
  const std::shared_ptr<scene::LiveScene> scene = find(request.scene());
  if (!scene) {
    const v1::Error error = noSuchScene(request.scene());
    return denied(error.code(), error.text());
  }
  if (!scene->roster.liftBan(request.subject()))
    return denied(v1::ERROR_CODE_NOT_FOUND,
                  fmt::format("liftBan.subject = '{:.64}': the scene '{}' has no such ban",
                              printable(request.subject()), scene->name()));
  return v1::LiftBanResponse();
}

}  // namespace clothstream::hosting
