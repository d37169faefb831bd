// SPDX-License-Identifier: MIT
// Both endpoints of the program, from their opening until the server stops.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/hosting/scene_server.h"
#include "server/identity/authenticator.h"
#include "server/monitoring/monitoring_endpoint.h"
#include "server/options/program_options.h"
#include "server/program/guards.h"
#include "server/program/signals.h"

namespace clothstream::program {

// Serves through both endpoints until a signal or --seconds ends it. `intro` is printed before the addresses.
// `report` is printed after SIGUSR1 and at the end. `authenticator` and `monitoring` may be null. `leave` is
// called before the peers are disconnected, and should return before the time that it is given. Returns what
// limits the time until the process ends.
[[nodiscard]] std::unique_ptr<EndGuard> openEndpoints(
    hosting::SceneServer& server, const ServeOptions& options, const Signals& signals, StartGuard& start,
    const std::shared_ptr<identity::Authenticator>& authenticator, monitoring::MonitoringEndpoint* monitoring,
    const std::string& intro, const std::function<std::string()>& report,
    const std::function<void(std::chrono::steady_clock::time_point)>& leave = {});

}  // namespace clothstream::program
