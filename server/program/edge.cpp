// SPDX-License-Identifier: MIT
// `clothstream-server edge`: scenes of other servers, served through both endpoints.
#include "server/fleet/edge.h"

#include <memory>
#include <string>

#include <fmt/format.h>

#include "server/hosting/scene_server.h"
#include "server/program/authentication.h"
#include "server/program/commands.h"
#include "server/program/endpoints.h"
#include "server/program/events.h"
#include "server/program/fleet.h"
#include "server/program/guards.h"
#include "server/program/monitoring.h"

namespace clothstream::program {

int edge(const ServeOptions& options, const Signals& signals) {
  StartGuard start(signals, options.server.drain);
  const auto monitoring = openMonitoring(options);
  std::unique_ptr<EndGuard> guard;  // outlives the server
  hosting::ServerOptions serverOptions = options.server;
  const std::shared_ptr<identity::Authenticator> authenticator = makeAuthenticator(options);
  serverOptions.authenticator = authenticator;
  serverOptions.observer = openEvents(options);
  hosting::SceneServer server(serverOptions);
  const fleet::Edge shown(server, natsOptions(options.nats, "edge"), serverOptions.reconnectGrace.place);
  shown.waitForOffers();  // clients that come back to an edge that starts again find their scenes
  guard = openEndpoints(
      server, options, signals, start, authenticator, monitoring.get(),
      fmt::format("shows   scenes of other servers, by {}\n", fmt::join(options.nats.servers, ", ")),
      [&] { return server.report(); });
  return 0;
}

}  // namespace clothstream::program
