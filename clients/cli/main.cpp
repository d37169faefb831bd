// SPDX-License-Identifier: MIT
// `clothstream`: command-line client of clothstream-server.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "clients/cli/comparison_commands.h"
#include "clients/cli/discover.h"
#include "clients/cli/error.h"
#include "clients/cli/exit_code.h"
#include "clients/cli/fleet.h"
#include "clients/cli/identity_commands.h"
#include "clients/cli/join.h"
#include "clients/cli/list.h"
#include "clients/cli/load_command.h"
#include "clients/cli/motion_commands.h"
#include "clients/cli/participant_commands.h"
#include "clients/cli/presence.h"
#include "clients/cli/print.h"
#include "clients/cli/recording_commands.h"
#include "clients/cli/recording_limits.h"
#include "clients/cli/saved_token.h"
#include "clients/cli/scene.h"
#include "clients/cli/set.h"
#include "clients/cli/set_options.h"
#include "clients/cli/signals.h"
#include "clients/cli/transport_option.h"
#include "clients/core/core.h"
#include "clients/grpc/channel.h"
#include "clients/grpc/identity.h"
#include "clients/native/address.h"
#include "proto/tls/fingerprint.h"

namespace {

using namespace clothstream;
using namespace clothstream::cli;

// Parses "x,y,z" or "x,y,z,radius".
cs_own_collider parseCollider(const std::string& text) {
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
  cs_own_collider sphere{};
  std::copy_n(values.begin(), 3, sphere.position);
  sphere.radius = values[3];
  return sphere;
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
                   "Fingerprint of the key of an https:// server with --tls self, as the server prints it")
        ->excludes(ca);
  }

  ServerAddress addressOf(const std::string& text, Endpoint endpoint) const {
    auto address = completeAddress(text, endpoint);
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
    if (server.isEncrypted() && caFile.empty() && fingerprint.empty()) {
      const auto kept = keptFingerprint(server);
      if (!kept) throw CLI::ValidationError("ADDRESS", kept.error());
      server.fingerprint = *kept;
    }
    return server;
  }

  // Before the first pairing with a server whose key is not known: shows the key that the server has, and
  // asks whether it is right. Leaves the address as it is if an authority has signed the key.
  static tl::expected<void, Failure> learnKey(ServerAddress& server) {
    if (!server.isEncrypted() || !server.caFile.empty() || !server.fingerprint.empty()) return {};
    const auto shown = unknownKeyOf(server);
    if (!shown) return tl::unexpected(shown.error());
    if (shown->empty()) return {};
    const auto refused = [&](const char* what) {
      return tl::unexpected(Failure{Failure::Kind::refused, fmt::format("The server at {} has the key {}. {}",
                                                                        server.address, *shown, what)});
    };
    if (isatty(STDIN_FILENO) == 0)
      return refused("If the server prints the same, use it with --fingerprint.");
    print(stderr, "The server at {} has the key\n  {}\nDoes the server print the same key? [y/N] ",
          server.address, *shown);
    std::string answer;
    std::getline(std::cin, answer);
    if (answer != "y" && answer != "Y" && answer != "yes") return refused("It is not trusted.");
    server.fingerprint = *shown;
    return {};
  }
};

// How this client proves who it is, for all commands that connect.
struct ProofOptions {
  std::string tokenFile, code;

  void add(CLI::App& app) {
    CLI::Option* const token =
        app.add_option("--token", tokenFile,
                       "File with the token for the server; - reads standard input. Default: the one that "
                       "--pair has kept for this server");
    app.add_option(
           "--pair", code,
           "Six digits that the server or an owner shows. The client gets a token for them and keeps it")
        ->excludes(token);
  }

  // Sets the token for this server, if there is one, and with --pair also its key. Both are kept after
  // pairing.
  tl::expected<void, Failure> prove(ServerAddress& server) const {
    const auto wrong = [](const std::string& text) {
      return tl::unexpected(Failure{Failure::Kind::refused, text});
    };
    const std::filesystem::path kept = tokenFileOf(server);
    std::error_code none;
    const bool hasToken = !tokenFile.empty() || std::filesystem::exists(kept, none);
    if ((!code.empty() || hasToken) && !server.isEncrypted() && !server.isLoopback())
      return wrong(fmt::format(
          "{}: others in the network could read the {} on its way to the server. Use https://{}, with TLS on "
          "the server (--tls self){}",
          server.address, code.empty() ? "token" : "pairing code", server.address,
          hasToken && tokenFile.empty() ? ", or delete " + kept.string() : ""));
    if (!code.empty()) {
      if (kept.empty()) return wrong("--pair needs a directory for the token: set HOME or XDG_STATE_HOME");
      if (auto learnt = TrustOptions::learnKey(server); !learnt) return learnt;
      const auto token = pair(server, code);
      if (!token) return tl::unexpected(token.error());
      if (const auto saved = saveLine(kept, *token); !saved) return wrong(saved.error());
      if (!server.fingerprint.empty())
        if (const auto saved = saveLine(fingerprintFileOf(server), server.fingerprint); !saved)
          return wrong(saved.error());
      server.token = *token;
      return {};
    }
    if (!hasToken) return {};
    const auto token = readToken(tokenFile.empty() ? kept : std::filesystem::path(tokenFile));
    if (!token) return wrong(token.error());
    server.token = *token;
    return {};
  }
};

int run(int argc, char** argv) {
  CLI::App app("Follows and records scenes of a clothstream-server; encodes motion files.", "clothstream");
  app.require_subcommand(1);
  app.set_version_flag("--version", CLOTHSTREAM_VERSION);

  TrustOptions trust;
  trust.add(app);
  ProofOptions proof;
  proof.add(app);
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
      .add_option("--role", role, "Role to request: viewer, participant or owner. Default: participant")
      ->check(CLI::IsMember({"viewer", "participant", "owner"}));
  joinCommand
      .add_option("--quality", joinOptions.quality,
                  "Finest quality to receive: 0 is the finest, each further level doubles the error")
      ->check(CLI::Range(0, 3));
  addStreamLimit(joinCommand, joinOptions.maxVertices);
  addTransport(joinCommand, joinOptions.datagrams);
  joinCommand.add_flag("!--no-reconnect", joinOptions.reconnects,
                       "End when the connection is lost. Default: try to reconnect for a minute");
  joinCommand
      .add_option("--seconds", joinOptions.seconds,
                  "Leave this long after the first frame; default: at an interrupt (Ctrl-C)")
      ->check(CLI::PositiveNumber);
  joinCommand.add_option("--obj", joinOptions.objPath, "Write the last frame to this Wavefront OBJ file");
  joinCommand.add_flag("--json", joinOptions.json, "Print only the summary, as one JSON object");
  joinCommand.add_flag("--hash", joinOptions.hash,
                       "Compare every decoded frame with the server's reconstruction");
  joinCommand
      .add_flag("--report", joinOptions.report,
                "Print each report of the simulation: strain, energy and more per cloth")
      ->excludes("--json");
  CLI::Option* const events =
      joinCommand
          .add_flag("--events", joinOptions.events,
                    "Print events as lines of JSON: participants, contacts, grabs, changes, notices, errors; "
                    "the last line is the summary")
          ->excludes("--json")
          ->excludes("--report");
  joinCommand
      .add_flag("--frames", joinOptions.frames, "With --events: also a line for each frame, with a hash")
      ->needs(events);
  CLI::Option* const input =
      joinCommand
          .add_option(
              "--input", joinOptions.inputPath,
              "File with lines of JSON that set colliders, hands, head, grabs and attachments; - reads "
              "standard input")
          ->type_name("FILE");
  joinCommand
      .add_option(
          "--collider", colliders,
          "Sphere X,Y,Z[,RADIUS] in metres that the cloth collides with while this client is joined; may be "
          "repeated")
      ->excludes(input)
      ->allow_extra_args(false);

  SetOptions setOptions;
  CLI::App& setCommand = *app.add_subcommand("set", "Change parameters of a running scene");
  addSetOptions(setCommand, setOptions);
  addStreamLimit(setCommand, setOptions.maxVertices);
  setCommand.add_option("ADDRESS", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();

  ListOptions listOptions;
  CLI::App& listCommand = *app.add_subcommand("list", "List the scenes of a server");
  listCommand.add_option("ADDRESS", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();
  listCommand.add_flag("--json", listOptions.json, "Print a JSON array");
  FleetCommands fleetCommands;
  fleetCommands.add(app, listCommand);

  DiscoverCommand discoverCommand;
  discoverCommand.add(app);

  SceneCommands sceneCommands;
  sceneCommands.add(app, address);

  IdentityCommands identityCommands;
  identityCommands.add(app, address);

  ParticipantCommands participantCommands;
  participantCommands.add(app, address);

  MotionCommands motionCommands;
  motionCommands.add(app);

  ComparisonCommands comparisonCommands;
  comparisonCommands.add(app);

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
    if (loadCommand.usesWeb() && !proof.code.empty())
      throw CLI::ValidationError(
          "--pair",
          "does not work with --web, because pairing uses gRPC. First pair with \"clothstream list HOST:PORT "
          "--pair CODE\", which keeps a token in ~/.local/state/clothstream/tokens; then use --token FILE");
    joinOptions.address = listOptions.address = setOptions.address =
        trust.addressOf(address, loadCommand.usesWeb() ? Endpoint::web : Endpoint::grpc);
    if (setCommand.parsed()) checkSetOptions(setOptions);
    if (colliders.size() > CS_MAX_COLLIDERS)
      throw CLI::ValidationError("--collider", fmt::format("at most {} are allowed", CS_MAX_COLLIDERS));
    joinOptions.role = roleNamed(role).value_or(CS_ROLE_UNSPECIFIED);
    for (const std::string& collider : colliders) joinOptions.colliders.push_back(parseCollider(collider));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  blockEndingSignals();
  if (discoverCommand.parsed()) return discoverCommand.run();
  if (fleetCommands.parsed()) return fleetCommands.run(listOptions.json);
  if (motionCommands.parsed()) return motionCommands.run();
  if (comparisonCommands.parsed()) return comparisonCommands.run(CLOTHSTREAM_VERSION);
  if (!recordingCommands.parsed() || recordingCommands.connects()) {
    const auto proved = proof.prove(joinOptions.address);
    if (!proved) return printError(proved.error());
    listOptions.address = setOptions.address = joinOptions.address;
  }
  if (identityCommands.parsed()) return identityCommands.run(joinOptions.address);
  if (participantCommands.parsed()) return participantCommands.run(joinOptions.address);
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
    std::fprintf(stderr, "clothstream: %s\n", printable(error.what()).c_str());
    return kFailed;
  }
}
