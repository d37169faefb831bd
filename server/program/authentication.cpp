// SPDX-License-Identifier: MIT
#include "server/program/authentication.h"

#include <exception>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/identity/pairing_codes.h"

namespace clothstream::program {

std::shared_ptr<identity::Authenticator> makeAuthenticator(const ServeOptions& options) {
  const bool asks = options.identity.pairing || !options.identity.tokenKeys.empty();
  if (!asks && !isReachable(options.network)) return nullptr;
  if (!asks && isLoopback(options.network.host))
    spdlog::warn(
        "--insecure: everyone who reaches {} through a program of this machine can join, and counts "
        "as a program of this machine (docs/identity.md)",
        options.network.publicNames.front());
  else if (!asks)
    spdlog::warn("--insecure: everyone who reaches {} can join, with the role {} (docs/identity.md)",
                 options.network.host, scene::nameOf(options.identity.anonymousRole));
  if (asks && !isLoopback(options.network.host) && !options.tls.self && options.tls.certificate.empty())
    spdlog::warn("tokens and pairing codes travel without encryption: add --tls self or --tls-certificate");
  return std::make_shared<identity::Authenticator>(
      identity::AuthenticatorOptions{.keyDirectory = options.identity.tokenKeys,
                                     .audience = options.identity.tokenAudience,
                                     .pairing = options.identity.pairing,
                                     .stateDirectory = options.state.directory,
                                     .anonymousRole = options.identity.anonymousRole});
}

void reload(identity::Authenticator& authenticator) {
  try {
    authenticator.reload();
    spdlog::info("the keys of tokens are read again");
  } catch (const std::exception& failure) {
    spdlog::error("the old keys of tokens stay in use: {}", failure.what());
  }
}

std::string pairingCodeLine(identity::Authenticator& authenticator) {
  const auto made = authenticator.makeCode(scene::Role::owner, identity::Clock::now());
  if (!made) return {};
  return fmt::format("pair    {} makes an owner for {} minutes; SIGUSR2 shows a new code\n", made->code,
                     identity::PairingCodes::kValid.count());
}

}  // namespace clothstream::program
