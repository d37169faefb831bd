// SPDX-License-Identifier: MIT
#include "clients/grpc/identity.h"

#include <utility>

#include "clients/grpc/channel.h"

namespace clothstream {
tl::expected<std::string, Failure> pair(const ServerAddress& address, const std::string& code) {
  v1::AuthenticateRequest request;
  request.set_pairing_code(code);
  auto response =
      callServer<v1::AuthenticateResponse>(address, request, &v1::ClothStream::Stub::Authenticate);
  if (!response) return tl::unexpected(std::move(response).error());
  if (response->token().empty())
    return tl::unexpected(
        Failure{Failure::Kind::refused, "The server at " + address.address + " needs no pairing."});
  return std::move(*response->mutable_token());
}

tl::expected<PairingCode, Failure> createPairingCode(const ServerAddress& address, cs_role role) {
  v1::CreatePairingCodeRequest request;
  request.set_role(static_cast<v1::Role>(role));
  const auto response =
      callServer<v1::CreatePairingCodeResponse>(address, request, &v1::ClothStream::Stub::CreatePairingCode);
  if (!response) return tl::unexpected(response.error());
  return PairingCode{response->code(), response->valid_s()};
}

tl::expected<std::vector<Ban>, Failure> listBans(const ServerAddress& address, const std::string& scene) {
  v1::ListBansRequest request;
  request.set_scene(scene);
  const auto response = callServer<v1::ListBansResponse>(address, request, &v1::ClothStream::Stub::ListBans);
  if (!response) return tl::unexpected(response.error());
  std::vector<Ban> bans;
  for (const v1::Ban& ban : response->bans()) bans.push_back({ban.subject(), ban.display_name()});
  return bans;
}

tl::expected<void, Failure> liftBan(const ServerAddress& address, const std::string& scene,
                                    const std::string& subject) {
  v1::LiftBanRequest request;
  request.set_scene(scene);
  request.set_subject(subject);
  const auto response = callServer<v1::LiftBanResponse>(address, request, &v1::ClothStream::Stub::LiftBan);
  if (!response) return tl::unexpected(response.error());
  return {};
}

}  // namespace clothstream
