// SPDX-License-Identifier: MIT
// `clothstream-server play`: a recording, served through both endpoints.
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "proto/recording/verdict.h"
#include "proto/text/printable.h"
#include "server/fleet/origin.h"
#include "server/hosting/scene_server.h"
#include "server/program/authentication.h"
#include "server/program/commands.h"
#include "server/program/endpoints.h"
#include "server/program/events.h"
#include "server/program/fleet.h"
#include "server/program/guards.h"
#include "server/program/monitoring.h"
#include "server/recording/playback.h"

namespace clothstream::program {

namespace {

// A test that compares frames must not run with less than the recording.
void checkWhole(recording::RecordedStream& recording, const std::string& path) {
  const auto whole = recording.check();
  if (whole && !recording.truncated()) return;
  throw std::runtime_error(
      fmt::format("{}; --lockstep plays only whole recordings: use an undamaged copy, or "
                  "play the result of clothstream recover",
                  whole ? path + ": the end is missing or damaged" : whole.error()));
}

}  // namespace

int play(const ServeOptions& options, const PlayOptions& play, const Signals& signals) {
  StartGuard start(signals, options.server.drain);
  const auto monitoring = openMonitoring(options);
  auto recording = recording::RecordedStream::open(play.recording, play.limits);
  if (!recording) throw std::runtime_error(recording.error());
  if (play.playback.from > recording->length())
    throw std::runtime_error(fmt::format("--from: {} s is after the end of {}; use 0 to {:.3f}",
                                         play.playback.from, play.recording, recording->length()));
  if (play.playback.lockstep) checkWhole(*recording, play.recording);
  if (recording->truncated())
    spdlog::warn("{} is truncated or damaged at its end; the readable part is played", play.recording);
  const std::string scene = recording->scene();
  const std::string intro = fmt::format("plays   {}, {:.1f} s of {}, recorded on {}\n", play.recording,
                                        recording->length(), scene, printable(recording->device()));
  if (play.playback.faults)
    spdlog::info("faults with the seed {}: frames are dropped and late on purpose", *play.playback.faults);
  std::unique_ptr<EndGuard> guard;  // outlives the server
  hosting::ServerOptions serverOptions = options.server;
  const std::shared_ptr<identity::Authenticator> authenticator = makeAuthenticator(options);
  serverOptions.authenticator = authenticator;
  serverOptions.observer = openEvents(options);
  const auto playback = std::make_shared<recording::Playback>(std::move(*recording), play.playback);
  hosting::SceneServer server(scene, playback, serverOptions);
  std::optional<fleet::Origin> origin;
  if (!options.nats.servers.empty())
    origin.emplace(server, natsOptions(options.nats, "server"), originOptions(options.network));
  guard = openEndpoints(server, options, signals, start, authenticator, monitoring.get(), intro,
                        [&] { return server.report(); });
  const std::string damage = playback->damage();
  if (damage.empty()) return 0;
  spdlog::error("{} is damaged: {}; clothstream recover {} OUT keeps what is whole", play.recording, damage,
                play.recording);
  return recording::kFileUnreadable;
}

}  // namespace clothstream::program
