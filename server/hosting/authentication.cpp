// SPDX-License-Identifier: MIT
#include "server/hosting/authentication.h"

#include <chrono>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "server/identity/authenticator.h"
#include "server/scene/roles.h"

namespace clothstream::hosting {
namespace {

tl::unexpected<messages::FieldError> noCode(v1::ErrorCode code, std::string text) {
  return tl::unexpected(messages::FieldError{code, std::move(text)});
}

}  // namespace

Authentication::Authentication(const ServerOptions& options, telemetry::ServerMetrics& metrics)
    : options_(options), metrics_(metrics) {}

messages::Result<Identity> Authentication::identify(const std::string& token, bool isLoopback) {
  if (!options_.authenticator) return identity::local();
  messages::Result<Identity> identity = token.empty() ? options_.authenticator->anonymous(isLoopback)
                                                      : options_.authenticator->verify(token, isLoopback);
  // A browser can send its token only after it has connected.
  if (!identity && !token.empty()) metrics_.refuse(telemetry::Refusal::token);
  return identity;
}

messages::Result<Identity> Authentication::authenticate(const v1::AuthenticateRequest& request,
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
  const bool isRequired = options_.authenticator && options_.authenticator->required();
  if (!isRequired || request.proof_case() != v1::AuthenticateRequest::kPairingCode)
    return answer(identify(request.token(), address.empty()));
  auto paired = options_.authenticator->pair(request.pairing_code(), address, now);
  if (!paired) {
    metrics_.refuse(telemetry::Refusal::pairingCode);
    return tl::unexpected(std::move(paired).error());
  }
  response.set_token(paired->token);
  return answer(std::move(paired->identity));
}

messages::Result<v1::CreatePairingCodeResponse> Authentication::createPairingCode(
    const Identity& by, const v1::CreatePairingCodeRequest& request, Clock::time_point now) {
  if (!options_.authenticator || !options_.authenticator->pairs())
    return noCode(v1::ERROR_CODE_INVALID_ARGUMENT,
                  "createPairingCode: this server does not pair; start it with --pairing");
  if (!by.isVerifiedOwner() || !by.scene.empty())
    return noCode(v1::ERROR_CODE_PERMISSION_DENIED,
                  "createPairingCode: requires a token with the role owner for all scenes");
  // Streams continue for some time after their token has expired, but a code made then would outlive it.
  if (const char* const why = options_.authenticator->whyEnded(by, std::chrono::seconds(0)))
    return noCode(v1::ERROR_CODE_UNAUTHENTICATED, fmt::format("createPairingCode: {}", why));
  if (request.role() < v1::ROLE_UNSPECIFIED || request.role() > v1::ROLE_OWNER)
    return noCode(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("createPairingCode.role = {}: must be ROLE_VIEWER, ROLE_PARTICIPANT or ROLE_OWNER",
                    static_cast<int>(request.role())));
  const scene::Role role =
      request.role() == v1::ROLE_UNSPECIFIED ? scene::Role::participant : scene::fromMessage(request.role());
  const auto made = options_.authenticator->makeCode(role, now);
  if (!made) return tl::unexpected(made.error());
  v1::CreatePairingCodeResponse response;
  response.set_code(made->code);
  response.set_role(scene::toMessage(made->role));
  response.set_valid_s(
      static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::seconds>(made->ends - now).count()));
  return response;
}

}  // namespace clothstream::hosting
