// SPDX-License-Identifier: MIT
// `clothstream`: command-line client of clothstream-server.
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "clients/cli/exit_code.h"
#include "clients/cli/join.h"
#include "clients/cli/list.h"
#include "clients/cli/load_command.h"
#include "clients/cli/motion_commands.h"
#include "clients/cli/presence.h"
#include "clients/cli/recording_commands.h"
#include "clients/cli/scene.h"
#include "clients/cli/set.h"
#include "clients/cli/set_options.h"
#include "clients/cli/signals.h"
#include "clients/core/core.h"
#include "clients/grpc/address.h"
#include "proto/tls/fingerprint.h"

namespace {

using namespace clothstream;
using namespace clothstream::cli;

// Parses "x,y,z" or "x,y,z,radius".
std::array<float, 4> parseCollider(const std::string& text) {
  constexpr float kDefaultRadius = 0.1f;
  std::array<float, 4> values{0, 0, 0, kDefaultRadius};
  std::size_t count = 0;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more && count < values.size(); ++count) {
    const auto [next, error] = std::from_chars(at, end, values[count]);
    if (error != std::errc() || !std::isfinite(values[count])) break;
    more = next != end && *next == ',';
    at = more ? next + 1 : next;
  }
  if (count < 3 || at != end || values[3] <= 0)
    throw CLI::ValidationError(
        "--collider", fmt::format("\"{}\" is not a sphere; use X,Y,Z or X,Y,Z,RADIUS in metres", text));
  return values;
}

// How to recognise a server with TLS, for all commands that connect.
struct TrustOptions {
  std::string caFile, fingerprint;

  void add(CLI::App& app) {
    CLI::Option* const ca =
        app.add_option("--ca", caFile,
                       "PEM file of the authorities that may have signed the certificate of an https:// "
                       "server. Default: those of the system")
            ->check(CLI::ExistingFile);
    app.add_option("--fingerprint", fingerprint,
                   "Key of an https:// server with a certificate of its own, as the server prints it")
        ->excludes(ca);
  }

  ServerAddress addressOf(const std::string& text) const {
    auto address = completeAddress(text);
    if (!address) throw CLI::ValidationError("ADDRESS", address.error());
    ServerAddress server(std::move(*address));
    server.caFile = caFile;
    if (!fingerprint.empty()) {
      const auto normal = normalFingerprint(fingerprint);
      if (!normal)
        throw CLI::ValidationError("--fingerprint",
                                   "must have 64 hexadecimal digits, as the server prints them");
      server.fingerprint = *normal;
    }
    if (!server.isEncrypted() && !(caFile.empty() && fingerprint.empty()))
      throw CLI::ValidationError("ADDRESS", "must begin with https:// for --ca and --fingerprint");
    return server;
  }
};

int run(int argc, char** argv) {
  CLI::App app("Follows and records scenes of a clothstream-server; encodes motion files.", "clothstream");
  app.require_subcommand(1);
  app.set_version_flag("--version", CLOTHSTREAM_VERSION);

  TrustOptions trust;
  trust.add(app);
  std::string address(kDefaultAddress);
  JoinOptions joinOptions;
  std::vector<std::string> colliders;
  CLI::App& joinCommand =
      *app.add_subcommand("join", "Join a scene, show the stream, print a summary at the end");
  joinCommand.add_option("ADDRESS", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();
  joinCommand.add_option("--scene", joinOptions.scene, "Scene to join; default: the server's default scene");
  std::string role;
  joinCommand.add_option("--name", joinOptions.name, "Name that other participants see, at most 64 bytes");
  joinCommand
      .add_option("--role", role,
                  "viewer, participant or owner; the first client that is not a viewer becomes the owner")
      ->check(CLI::IsMember({"viewer", "participant", "owner"}));
  joinCommand
      .add_option("--quality", joinOptions.quality,
                  "Finest quality to receive: 0 is the finest, each further level doubles the error")
      ->check(CLI::Range(0, 3));
  joinCommand
      .add_option("--layers", joinOptions.temporalLayers,
                  "Most temporal layers to receive; fewer layers mean fewer frames a second. Default: all")
      ->check(CLI::Range(1, 3));
  joinCommand.add_flag("!--no-reconnect", joinOptions.reconnects,
                       "End when the connection is lost. Default: try to reconnect for a minute");
  joinCommand
      .add_option("--seconds", joinOptions.seconds,
                  "Leave after this time; default: at an interrupt (Ctrl-C)")
      ->check(CLI::PositiveNumber);
  joinCommand.add_option("--obj", joinOptions.objPath, "Write the last frame to this Wavefront OBJ file");
  joinCommand.add_flag("--json", joinOptions.json, "Print only the summary, as one JSON object");
  joinCommand.add_flag("--hash", joinOptions.hash,
                       "Compare every decoded frame with the server's reconstruction");
  joinCommand
      .add_flag("--report", joinOptions.report,
                "Print each report of the simulation: strain, energy and more per cloth")
      ->excludes("--json");
  joinCommand
      .add_option(
          "--collider", colliders,
          "Sphere X,Y,Z[,RADIUS] in metres that the cloth collides with while this client is joined; may be "
          "repeated")
      ->allow_extra_args(false);

  SetOptions setOptions;
  CLI::App& setCommand = *app.add_subcommand("set", "Change parameters of a running scene");
  addSetOptions(setCommand, setOptions);
  setCommand.add_option("ADDRESS", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();

  ListOptions listOptions;
  CLI::App& listCommand = *app.add_subcommand("list", "List the scenes of a server");
  listCommand.add_option("ADDRESS", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();
  listCommand.add_flag("--json", listOptions.json, "Print a JSON array");

  SceneCommands sceneCommands;
  sceneCommands.add(app, address);

  MotionCommands motionCommands;
  motionCommands.add(app);

  RecordingCommands recordingCommands;
  recordingCommands.add(app, address);

  LoadCommand loadCommand;
  loadCommand.add(app);

  app.footer(exitCodeHelp());
  for (CLI::App* command : app.get_subcommands({})) command->footer(exitCodeHelp())->fallthrough();

  try {
    app.parse(argc, argv);
    sceneCommands.check();
    loadCommand.check();
    if (loadCommand.parsed()) address = loadCommand.address();
    joinOptions.address = listOptions.address = setOptions.address = trust.addressOf(address);
    if (setCommand.parsed() && !changesAnything(setOptions))
      throw CLI::ValidationError("set", "nothing to change is given; see clothstream set --help");
    if (colliders.size() > CS_MAX_COLLIDERS)
      throw CLI::ValidationError("--collider", fmt::format("at most {} are allowed", CS_MAX_COLLIDERS));
    joinOptions.role = roleNamed(role).value_or(CS_ROLE_UNSPECIFIED);
    for (const std::string& collider : colliders) joinOptions.colliders.push_back(parseCollider(collider));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  blockEndingSignals();
  if (motionCommands.parsed()) return motionCommands.run();
  if (recordingCommands.parsed()) return recordingCommands.run(joinOptions.address, CLOTHSTREAM_VERSION);
  if (loadCommand.parsed()) return loadCommand.run(joinOptions.address);
  if (sceneCommands.parsed()) return sceneCommands.run(joinOptions.address);
  if (setCommand.parsed()) return set(setOptions);
  return listCommand.parsed() ? list(listOptions) : join(joinOptions);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream: %s\n", error.what());
    return kLost;
  }
}
