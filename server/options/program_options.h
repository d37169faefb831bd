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

// Whether frames and input also travel in datagrams.
enum class DatagramUse : std::uint8_t {
  automatic,  // if the port can be opened
  required,   // an error at the start if the port cannot be opened
  off,
};

// The endpoints of a server.
struct NetworkOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080, grpcPort = 50051;
  bool reflects = false;       // gRPC reflection
  std::filesystem::path page;  // empty: the directory next to the program, if it exists
  std::vector<std::string> publicNames, allowedOrigins;
  DatagramUse datagrams = DatagramUse::automatic;
  std::optional<std::uint16_t> datagramPort;  // unset: the number of the page's port
  std::vector<std::string> publicAddresses;   // IPv4 and IPv6, as text
  std::uint32_t maxConnections = 256;         // of each endpoint
  bool announces = false;                     // by mDNS
};

// TLS for both endpoints: with a self-signed certificate, or with that in the files.
struct TlsOptions {
  bool self = false;
  std::filesystem::path certificate, key, clientCa;  // empty: none
};

struct MetricsOptions {
  std::string host = "127.0.0.1";
  std::optional<std::uint16_t> port;  // unset: no monitoring
};

struct NatsOptions {
  std::vector<std::string> servers;              // empty: this server is alone
  std::filesystem::path credentials, authority;  // empty: none
};

// Webhook that gets events. Both are set, or none.
struct WebhookOptions {
  std::string url;
  std::filesystem::path secret;
};

// Identity of peers.
struct IdentityOptions {
  std::filesystem::path tokenKeys;  // directory; empty: none
  std::string tokenAudience = "clothstream";
  bool pairing = false, insecure = false;
  scene::Role anonymousRole = scene::Role::participant;  // with insecure
};

// Recordings of running scenes. Sizes are in megabytes; 0 means no limit.
struct RecordOptions {
  std::filesystem::path directory;  // empty: nothing is recorded
  bool onRequest = false;           // record only scenes that clients ask for
  double fileLimitMb = 0;
  double directoryLimitMb = 10'000;
};

// Folder with what the server keeps for its next start.
struct StateOptions {
  std::filesystem::path directory;
  bool keepsScenes = false;  // the directory was named: scenes are kept there too
  double limitMb = 1000;     // megabytes of kept scenes; 0 means no limit
};

// Options of the commands that serve scenes. `doctor` checks them.
struct ServeOptions {
  hosting::ServerOptions server;  // `device` is also the device of `step`, `resimulate` and `doctor`
  std::vector<std::filesystem::path> sceneFiles;
  NetworkOptions network;
  TlsOptions tls;
  MetricsOptions metrics;
  NatsOptions nats;
  std::optional<std::uint16_t> agonesPort;  // of the sidecar's REST interface; unset: no game server
  WebhookOptions webhook;
  IdentityOptions identity;
  RecordOptions record;
  StateOptions state;
  double keepFreeMb = 1000;  // megabytes of the disk that recordings and saved states leave free
  std::optional<std::chrono::nanoseconds> stopAfter;
};

struct PlayOptions {
  std::string recording;  // file
  recording::ReadLimits limits;
  recording::PlaybackOptions playback;
};

struct ResimulateOptions {
  std::string recording;  // file
  recording::ReadLimits limits;
  std::filesystem::path states;  // file of states to write; empty: none
  bool json = false;
};

struct StepOptions {
  std::string scene;                            // name or file
  std::optional<std::uint32_t> rate, substeps;  // unset keeps the scene's own value
  step::StepOptions run;
};

struct TokenOptions {
  std::filesystem::path key;     // signs the token
  std::filesystem::path newKey;  // a key is made here instead
  std::string scene, name, subject, tenant;
  scene::Role role = scene::Role::participant;
  std::chrono::seconds valid{0};
};

struct DoctorOptions {
  double seconds = 10;           // for measuring the capacity; 0 leaves it out
  bool accepts = false;          // compares states of the built-in scenes
  std::filesystem::path report;  // as JSON; empty: none
  bool json = false;             // print JSON
};

struct LogOptions {
  std::string level = "info", format = "text";
};

// Options of the program. Those of commands other than the chosen one have their defaults.
struct ProgramOptions {
  Command command = Command::serve;
  LogOptions log;
  std::vector<std::string> warnings;  // about environment variables, for the log

  ServeOptions serve;
  PlayOptions play;
  ResimulateOptions resimulate;
  StepOptions step;
  std::string printScene;  // name or file
  TokenOptions token;
  DoctorOptions doctor;
};

// Returns whether only programs on this machine reach a server that listens on `host`.
bool isLoopback(const std::string& host);

// Whether clients on other machines reach the server: --host is not a loopback address, or --public-name says
// that a program of this machine, such as a proxy, forwards them.
bool isReachable(const NetworkOptions& network);

// Returns the options, or the exit code if the program must end: after --help, --version, --print-config or a
// wrong option. The output or the error has then been printed.
std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv);

}  // namespace clothstream
