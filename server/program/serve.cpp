// SPDX-License-Identifier: MIT
// `clothstream-server serve`: scenes on a device, served through both endpoints.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/fleet/origin.h"
#include "server/hosting/scene_server.h"
#include "server/model/scene.h"
#include "server/program/authentication.h"
#include "server/program/commands.h"
#include "server/program/endpoints.h"
#include "server/program/events.h"
#include "server/program/fleet.h"
#include "server/program/guards.h"
#include "server/program/monitoring.h"
#include "server/program/scenes.h"
#include "server/recording/recordings.h"
#include "server/saved_state/saved_state.h"
#include "server/simulation/software_threads.h"

namespace clothstream::program {
namespace {

std::uint64_t bytesOf(double megabytes) {
  return static_cast<std::uint64_t>(megabytes * 1e6);
}

}  // namespace

int serve(const ServeOptions& options, const Signals& signals) {
  StartGuard start(signals, options.server.drain);
  const auto monitoring = openMonitoring(options);
  std::vector<std::string> builtIn;
  std::vector<model::Scene> scenes = loadScenes(options, builtIn);
  std::string sceneList;
  for (const model::Scene& scene : scenes)
    sceneList +=
        fmt::format("{}{} ({} vertices)", sceneList.empty() ? "" : ", ", scene.name, scene.nodeCount());

  std::unique_ptr<EndGuard> guard;  // outlives everything that may not end
  // Outlives the scenes, because it waits for their last records.
  std::optional<recording::Recordings> recordings;
  std::shared_ptr<saved_state::SavedState> savedState;
  if (options.state.keepsScenes)
    savedState = std::make_shared<saved_state::SavedState>(
        saved_state::SavedStateOptions{.directory = options.state.directory,
                                       .maxBytes = bytesOf(options.state.limitMb),
                                       .minFreeBytes = bytesOf(options.keepFreeMb)});
  if (!options.record.directory.empty())
    recordings.emplace(
        recording::RecorderOptions{
            .directory = options.record.directory,
            .serverName = kServerName,
            .maxBytes = bytesOf(options.record.fileLimitMb),
            .disk = std::make_shared<recording::DiskShare>(
                options.record.directory,
                recording::DiskLimits{.maxBytes = bytesOf(options.record.directoryLimitMb),
                                      .minFreeBytes = bytesOf(options.keepFreeMb)})},
        !options.record.onRequest);
  const auto first = std::ranges::find(scenes, options.server.defaultScene, &model::Scene::name);
  const std::uint32_t nodes = first == scenes.end() ? 0 : first->nodeCount();
  hosting::ServerOptions serverOptions = options.server;
  serverOptions.device = simulation::suitedTo(nodes, options.server.device);
  const std::shared_ptr<identity::Authenticator> authenticator = makeAuthenticator(options);
  serverOptions.authenticator = authenticator;
  serverOptions.journals = [&](const model::Scene& scene) {
    return recordings ? recordings->add(scene.name) : nullptr;
  };
  serverOptions.store = savedState;
  serverOptions.observer = openEvents(options);
  serverOptions.guestScenes = std::move(builtIn);
  hosting::SceneServer server(std::move(scenes), std::move(serverOptions));
  std::optional<fleet::Origin> origin;
  if (!options.nats.servers.empty())
    origin.emplace(server, natsOptions(options.nats, "server"), originOptions(options.network));
  const auto report = [&] { return server.report() + (recordings ? recordings->report() : ""); };
  guard = openEndpoints(
      server, options, signals, start, authenticator, monitoring.get(),
      fmt::format("device  {}\nscenes  {}\n", vulkan::describe(server.device.info()), sceneList), report,
      [&](schedule::Clock::time_point until) {
        if (origin) origin->moveAll(until);
      });
  return 0;
}

}  // namespace clothstream::program
