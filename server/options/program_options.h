// SPDX-License-Identifier: MIT
// Options of clothstream-server: from the command line, the environment and an option file.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/hosting/server_options.h"
#include "server/model/scene.h"
#include "server/recording/playback.h"
#include "server/scene/roles.h"
#include "server/step/step.h"

namespace clothstream {

inline constexpr const char* kServerName = "clothstream-server " CLOTHSTREAM_VERSION;
// The version as one number that grows.
inline constexpr std::uint32_t kServerVersion = CLOTHSTREAM_VERSION_NUMBER;

// Exit code after SIGINT or SIGTERM, as shells use it.
inline constexpr int kInterrupted = 130;

enum class Command {
  serve,
  play,
  edge,
  resimulate,
  step,
  printScene,
  token,
  doctor,
  listDevices,
  listMaterials
};

// Options of the command `token`.
struct TokenOptions {
  std::filesystem::path key;     // signs the token
  std::filesystem::path newKey;  // a key is made here instead
  std::string scene, name, subject, tenant;
  scene::Role role = scene::Role::participant;
  std::chrono::seconds valid{0};
};

// Options of the command `doctor`.
struct DoctorOptions {
  double seconds = 10;           // for measuring the capacity; 0 leaves it out
  bool accepts = false;          // compares states of the built-in scenes
  std::filesystem::path report;  // as JSON; empty: none
};

struct ProgramOptions {
  Command command = Command::serve;

  // Scenes, participants, device and limits. `defaultScene` is also the scene of `step`; `device` is also the
  // device of `step` and `resimulate`.
  hosting::ServerOptions server;
  std::vector<std::filesystem::path> sceneFiles;
  std::filesystem::path recordDirectory;  // empty: nothing is recorded
  bool recordsOnRequest = false;          // record only scenes that clients ask for
  double recordLimitMb = 0;               // megabytes per file; 0 means no limit
  double recordingsLimitMb = 10'000;      // megabytes of all recordings in the directory; 0 means no limit
  double keepFreeMb = 1000;               // megabytes of the disk that recordings and saved states leave free

  // Network.
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080, grpcPort = 50051;
  bool reflects = false;       // gRPC reflection
  std::filesystem::path page;  // empty: the directory next to the program, if it exists
  std::vector<std::string> publicNames, allowedOrigins;
  std::uint32_t maxConnections = 256;  // of each endpoint
  std::string metricsHost = "127.0.0.1";
  std::optional<std::uint16_t> metricsPort;  // unset: no monitoring
  bool announces = false;                    // by mDNS
  // TLS for both endpoints: with a self-signed certificate, or with that in the files.
  bool tlsSelf = false;
  std::filesystem::path tlsCertificate, tlsKey, tlsClientCa;  // empty: none

  // Other servers.
  std::vector<std::string> natsServers;                  // empty: this server is alone
  std::filesystem::path natsCredentials, natsAuthority;  // empty: none

  bool isGameServer = false;        // of Agones
  std::uint16_t agonesPort = 9358;  // of the sidecar's REST interface

  // Webhook that gets events. Both are set, or none.
  std::string eventsUrl;
  std::filesystem::path eventsSecret;

  // Identity of peers.
  std::filesystem::path tokenKeys;  // directory; empty: none
  std::string tokenAudience = "clothstream";
  bool pairing = false, insecure = false;
  scene::Role anonymousRole = scene::Role::participant;  // with insecure

  // Program.
  std::string logLevel = "info", logFormat = "text";
  std::optional<std::chrono::nanoseconds> stopAfter;
  std::filesystem::path stateDirectory;  // what the server keeps for its next start
  bool keepsScenes = false;              // the directory was named: scenes are kept there too
  double stateLimitMb = 1000;            // megabytes of kept scenes; 0 means no limit
  std::vector<std::string> warnings;     // about environment variables, for the log

  // Commands.
  step::StepOptions step;
  std::optional<std::uint32_t> stepRate, stepSubsteps;  // unset keeps the scene's own value
  recording::PlaybackOptions playback;
  std::string playSpeed = "1";  // of `play`: a number or "max"
  std::string recording;        // file of `play` and `resimulate`
  recording::ReadLimits recordingLimits;
  std::string printScene;        // name or file
  std::filesystem::path states;  // file of states that `resimulate` writes; empty: none
  bool json = false;             // `resimulate` and `doctor` print JSON
  DoctorOptions doctor;
  TokenOptions token;
};

// Returns whether only programs on this machine reach a server that listens on `host`.
bool isLoopback(const std::string& host);

// Whether clients on other machines reach the server: --host is not a loopback address, or --public-name says
// that a program of this machine, such as a proxy, forwards them.
bool isReachable(const ProgramOptions& options);

// Returns the options, or the exit code if the program must end: after --help, --version, --print-config or a
// wrong option. The output or the error has then been printed.
std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv);

}  // namespace clothstream
