// SPDX-License-Identifier: MIT
// Decides who peers are: tokens, pairing codes, and peers that need neither.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/server_options.h"
#include "server/identity/identity.h"
#include "server/messages/field_error.h"
#include "server/schedule/clock.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

using identity::Identity;
using schedule::Clock;

// Thread-safe.
class Authentication {
 public:
  // The arguments must outlive this.
  Authentication(const ServerOptions& options, telemetry::ServerMetrics& metrics);

  // Identity of a peer that has sent this token; empty for none. UNAUTHENTICATED if that is not enough.
  messages::Result<Identity> identify(const std::string& token, bool isLoopback);
  // Pairs a peer, or checks its token. `address` groups the attempts of one peer; empty for loopback.
  // `response` gets what the peer learns about its identity.
  messages::Result<Identity> authenticate(const v1::AuthenticateRequest& request, const std::string& address,
                                          Clock::time_point now, v1::AuthenticateResponse& response);
  // Returns PERMISSION_DENIED, with the reason, if the peer may not do this.
  messages::Result<v1::CreatePairingCodeResponse> createPairingCode(
      const Identity& by, const v1::CreatePairingCodeRequest& request, Clock::time_point now);

 private:
  const ServerOptions& options_;
  telemetry::ServerMetrics& metrics_;
};

}  // namespace clothstream::hosting
