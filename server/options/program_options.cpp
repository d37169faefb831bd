// SPDX-License-Identifier: MIT
// Rows of the server's table of options.
#include "server/options/program_options.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <unistd.h>

#include "proto/recording/verdict.h"
#include "server/events/url.h"
#include "server/hosting/limits.h"
#include "server/hosting/server_options.h"
#include "server/options/option_table.h"
#include "server/options/profile_table.h"
#include "server/scene/roles.h"

namespace clothstream {
namespace {

constexpr NumberRange kPort{.min = 0, .max = 65535, .type = "PORT", .noun = "a port"};
constexpr NumberRange kRate{.min = 1, .max = 1000};
constexpr NumberRange kDoctorSeconds{.min = 0, .max = 600};
constexpr NumberRange kSubsteps{.min = 1, .max = 256};
constexpr NumberRange kTicks{.min = 1, .max = 1e9};
constexpr NumberRange kThreads{.min = 0, .max = 64};

// Default, as the documentation shows it, of an option that sets a limit of the profile alone.
constexpr const char* kOfProfile = "by profile";

// The user's directory of a kind: that of the variable, or one in the home directory; empty without both.
std::filesystem::path userDirectory(const char* variable, const char* inHome) {
  if (const char* directory = std::getenv(variable); directory != nullptr && *directory != '\0')
    return std::filesystem::path(directory) / "clothstream";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::filesystem::path(home) / inHome / "clothstream";
  return {};
}

// Values that need a conversion after parsing, and flags that name a command.
struct Parsed {
  ProgramOptions options;
  std::vector<std::string> changeable, allowed;
  std::string record, recordings, playSpeed = "1", config, tls = "off", announce = "auto", transport = "auto",
                                  overload = "adapt", tokenValid = "8h", kernels = "auto";
  std::optional<scene::Role> anonymousRole, tokenRole;
  std::optional<hosting::SurfacePolicy> roomSurfaces;
  std::optional<hosting::Profile> chosenProfile;
  // Limits of the profile that are set alone.
  std::optional<std::chrono::milliseconds> sceneLifetime;
  std::optional<double> maxUploadMb;
  bool ownersAlone = false;
  CLI::Option *sceneLifetimeOption = nullptr, *maxUploadOption = nullptr, *ownersAloneOption = nullptr;
  CLI::Option* stateDirectory = nullptr;
  bool isGameServer = false, listDevices = false, listMaterials = false, printConfig = false,
       printMarkdown = false;

  hosting::Profile profile() const { return chosenProfile.value_or(hosting::Profile::home); }
};

void addBudgetOptions(OptionTable& table, scene::BudgetLimits& budget) {
  const NumberRange loads{.min = 0, .max = 1e6, .type = "LOAD"};
  const NumberRange megabytes{.min = 0, .max = 1e9, .type = "MEGABYTES"};
  table.number(
      "--max-load", budget.load, loads,
      "Seconds of the device's time a second that clients may take in all by creating scenes and changing "
      "parameters, by estimate. 1 means the whole time of the device. --profile sets the share of one scene");
  table.number(
      "--max-tick-time", budget.tickSeconds, {.min = 0, .max = 3600, .type = "SECONDS"},
      "Time of the device that one tick of a created or changed scene may take, by estimate. 0 means no "
      "limit");
  table.number("--max-memory", budget.megabytes, megabytes,
               "Memory that clients may take in all by creating scenes and changing parameters, by estimate. "
               "--profile sets the share of one scene");
}

void addSceneOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("Scenes");
  table.text("--scene", options.server.defaultScene, "NAME", "Default scene, for clients that name none");
  table.list("--scene-file", options.sceneFiles, "FILE",
             "Additional scene as a JSON file; may be repeated. Replaces a built-in scene of the same name");
  table.flag(
      "--always-run", options.server.runAlways,
      "Keep simulating without clients: --scene from the start, other scenes after their first client");
  table.text(
      "--overload", parsed.overload, "POLICY",
      "What a scene reduces if the device cannot keep up with it: adapt (frames, then substeps, then the "
      "speed of simulated time) or keep (only the speed)",
      checkChoice({"adapt", "keep"}));
  table.number("--reports", options.server.reportRate, {.min = 0, .max = 1000},
               "Simulation reports per second (strain, energy, ...). 0 sends none");
  CLI::Option* record = table.text("--record", parsed.record, "DIR",
                                   "Record every running scene, each to its own file in this directory");
  table.exclude(record, table.text("--recordings", parsed.recordings, "DIR",
                                   "Record scenes when a client asks for it, to files in this directory"));
  table.number("--record-limit", options.record.fileLimitMb, {.min = 0, .max = 1e9, .type = "MEGABYTES"},
               "Start a new file when a recording reaches this many megabytes. 0 means no limit");
  table.number(
      "--recordings-limit", options.record.directoryLimitMb, {.min = 0, .max = 1e9, .type = "MEGABYTES"},
      "Stop recording when all recordings in the directory take this many megabytes. 0 means no limit");
  table.number("--keep-free", options.keepFreeMb, {.min = 0, .max = 1e9, .type = "MEGABYTES"},
               "Stop recording, and saving states of scenes, when the disk has this many megabytes left");
  table.number("--max-created-scenes", options.server.maxCreatedScenes, {.min = 0, .max = 1000},
               "Scenes that clients may create in addition. 0 allows none");
  parsed.sceneLifetimeOption = table.number(
      "--scene-lifetime", parsed.sceneLifetime, {.min = 0, .max = 1e6, .type = "SECONDS"},
      "Seconds without participants after which a scene that a client created is deleted. 0 keeps it");
  table.showDefault(parsed.sceneLifetimeOption, kOfProfile);
  addBudgetOptions(table, options.server.budget);
  table.number(
      "--encoder-threads", options.server.encoderThreads, kThreads,
      "CPU threads that encode frames of different scenes, and that together predict a large frame "
      "where the device does not, or begin and finish the ticks of many scenes. 0 means three quarters of "
      "the processors, at most 16, to encode, and a quarter, at most 8, for the rest");
  table.action("--list-materials", parsed.listMaterials, "List the materials of cloths, and exit");
}

// Value of --participants-change.
std::string toText(const scene::Permissions& permissions) {
  std::vector<std::string> words;
  if (permissions.environment) words.push_back("environment");
  if (permissions.cloths) words.push_back("cloths");
  if (permissions.colliders) words.push_back("colliders");
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ","));
}

const std::map<std::string, hosting::SurfacePolicy> kSurfacePolicies{
    {"off", hosting::SurfacePolicy::off},
    {"own", hosting::SurfacePolicy::own},
    {"everyone", hosting::SurfacePolicy::everyone}};

void addParticipantOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("Participants");
  table.number("--hold", options.server.reconnectGrace.place, {.min = 0, .max = 3600, .type = "SECONDS"},
               "Reconnect grace: seconds for which a disconnected participant keeps its place. 0 means none");
  table.number("--hold-page", options.server.reconnectGrace.page, {.min = 0, .max = 3600, .type = "SECONDS"},
               "Seconds for which a participant whose page was closed or reloaded keeps its place, at most "
               "--hold. 0 means none");
  table.number("--max-participants", options.server.maxParticipants,
               {.min = 1, .max = hosting::kMaxParticipants},
               "Participants per scene. When the scene is full, the participant that has been disconnected "
               "longest is evicted");
  CLI::Option* changeable = table.list(
      "--participants-change", parsed.changeable, "LIST",
      "Parameters that participants may change in a scene that another participant owns: a comma-separated "
      "list of environment, cloths and colliders, or none",
      checkChoice({"environment", "cloths", "colliders", "none"}));
  const std::string changeableByDefault = toText(options.server.participantsMay);
  changeable->delimiter(',')
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->default_str(changeableByDefault);
  table.showDefault(changeable, changeableByDefault.c_str());
  CLI::Option* allowed = table.list(
      "--participants-may", parsed.allowed, "LIST",
      "What the role participant may do without being an owner: a comma-separated list of create, delete, "
      "control (pause, reset, seek), record, and own (become the owner of a scene that has none), or none",
      checkChoice({"create", "delete", "control", "record", "own", "none"}));
  allowed->delimiter(',')->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)->default_str("none");
  table.showDefault(allowed, "none");
  CLI::Option* surfaces = table.choice(
      "--room-surfaces", parsed.roomSurfaces, kSurfacePolicies,
      "Surfaces of the real rooms of participants: own lets them act on the cloth of their scene and sends "
      "their shape to no client, everyone also sends it to all in the scene, off refuses them");
  table.showDefault(surfaces, "own");
  parsed.ownersAloneOption =
      table.flag("--owners-alone", parsed.ownersAlone,
                 "Only its owners may pause, reset, record and delete a scene that has an owner");
  table.showDefault(parsed.ownersAloneOption, kOfProfile);
}

const std::map<std::string, scene::Role> kRoles{{"viewer", scene::Role::viewer},
                                                {"participant", scene::Role::participant},
                                                {"owner", scene::Role::owner}};

void addIdentityOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("Identity");
  table.text("--token-keys", options.identity.tokenKeys, "DIR",
             "Require a token of every client, signed by a key in this directory: NAME.pem for ES256, "
             "NAME.secret for HS256. SIGHUP reads them again");
  table.text("--token-audience", options.identity.tokenAudience, "NAME",
             "Audience (aud) that tokens must have");
  table.flag("--pairing", options.identity.pairing,
             "Require a token, or a six-digit code that the server shows at its start and after SIGUSR2");
  table.flag(
      "--insecure", options.identity.insecure,
      "Let in everyone who reaches the server, although --host is not a loopback address or there is a "
      "--public-name");
  CLI::Option* role = table.choice("--anonymous-role", parsed.anonymousRole, kRoles,
                                   "Role of clients on other machines with --insecure");
  table.showDefault(role, "participant");
  CLI::Option* ofTenant =
      table.number("--max-scenes-per-tenant", options.server.maxScenesPerTenant, {.min = 0, .max = 1000},
                   "Created scenes of one tenant. Clients without a tenant share one number");
  table.showDefault(ofTenant, "a quarter of --max-created-scenes with --token-keys, else all of them");
}

// Checks the options together.
void checkIdentity(const IdentityOptions& identity, const NetworkOptions& network) {
  const bool asks = identity.pairing || !identity.tokenKeys.empty();
  if (identity.insecure && asks)
    throw OptionError("--insecure excludes --token-keys and --pairing: remove it, or both of them");
  if (!asks && !identity.insecure && isReachable(network))
    throw OptionError(fmt::format(
        "{}: {} is reachable from other machines, and no client would have to prove who it is; add "
        "--pairing or --token-keys DIR, or --insecure to let everyone in (docs/identity.md)",
        isLoopback(network.host) ? "--public-name" : "--host",
        isLoopback(network.host) ? network.publicNames.front() : network.host));
}

Check checkAddress() {
  return [](const std::string& text) -> std::string {
    in6_addr address{};  // has room for both families
    if (::inet_pton(AF_INET, text.c_str(), &address) == 1 ||
        ::inet_pton(AF_INET6, text.c_str(), &address) == 1)
      return {};
    return fmt::format("'{}' is not an address; use one such as 192.0.2.1 or 2001:db8::1", text);
  };
}

void addNetworkOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("Network");
  table.text("--host", options.network.host, "ADDRESS", "Address to listen on; 0.0.0.0 means all addresses");
  table.number("--port", options.network.port, kPort,
               "Port of the page and the WebSocket. 0 picks a free port");
  table.number("--grpc-port", options.network.grpcPort, kPort, "Port of gRPC. 0 picks a free port");
  table.text(
      "--transport", parsed.transport, "WAY",
      "Way of frames and input: datagrams (an error if the UDP port cannot be opened), tcp (the stream of "
      "each client alone), or auto: datagrams if the port can be opened. Clients that no datagram reaches "
      "stay on their streams",
      checkChoice({"auto", "datagrams", "tcp"}));
  CLI::Option* datagramPort =
      table.number("--datagram-port", options.network.datagramPort, kPort,
                   "UDP port of datagrams. Others must be able to reach it. 0 picks a free port");
  table.showDefault(datagramPort, "the number of --port");
  table.list(
      "--public-address", options.network.publicAddresses, "ADDRESS",
      "IPv4 or IPv6 address under which clients reach the UDP port, such as that of a router that forwards "
      "it; may be repeated. The address that a client's connection has reached is always tried",
      checkAddress());
  table.text("--page", options.network.page, "DIR",
             "Directory of the page, instead of the one next to the program");
  table.list(
      "--public-name", options.network.publicNames, "NAME",
      "Name under which browsers reach the page, such as cloth.example.org; may be repeated. Addresses, "
      "localhost and the name of the machine are always allowed");
  table.flag("--reflection", options.network.reflects,
             "Offer gRPC reflection, by which tools such as grpcurl learn the calls without session.proto");
  table.list("--allow-origin", options.network.allowedOrigins, "ORIGIN",
             "Origin of another page that may connect, such as https://example.org; may be repeated");
  table.text(
      "--announce", parsed.announce, "WHEN",
      "Announce the server by mDNS to this network, where `clothstream discover` finds it: on, off, or "
      "auto: with --tls self and a --host that others reach",
      checkChoice({"auto", "on", "off"}));
  table.number("--max-connections", options.network.maxConnections, {.min = 1, .max = 100'000},
               "Connections to each port at a time");
  table.number("--metrics-port", options.metrics.port, kPort,
               "Port of /metrics, /healthz and /readyz for operators. 0 picks a free port. Off by default");
  table.text("--metrics-host", options.metrics.host, "ADDRESS", "Address to listen on with --metrics-port");
}

std::map<std::string, hosting::Profile> profiles() {
  std::map<std::string, hosting::Profile> profiles;
  for (std::size_t i = 0; i < hosting::kProfileNames.size(); ++i)
    profiles[hosting::kProfileNames[i]] = static_cast<hosting::Profile>(i);
  return profiles;
}

void addLimitOptions(OptionTable& table, Parsed& parsed) {
  table.group("Limits");
  CLI::Option* profile = table.choice(
      "--profile", parsed.chosenProfile, profiles(),
      "Limits for the network of the server: home (a private network), public (the internet: smaller scenes "
      "and uploads, fewer connections of one address, no control from outside) or fleet (behind a gateway: "
      "no limits for one address). An option that is given wins over its profile");
  profile->default_str(hosting::kProfileNames.front());
  table.showDefault(profile, hosting::kProfileNames.front());
  parsed.maxUploadOption =
      table.number("--max-upload-memory", parsed.maxUploadMb, {.min = 0, .max = 1e6, .type = "MEGABYTES"},
                   "Memory of all uploads together, in megabytes");
  table.showDefault(parsed.maxUploadOption, kOfProfile);
}

void addTlsOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("TLS");
  table.text("--tls", parsed.tls, "KIND",
             "self: use a certificate of the server's own, for a home network; off",
             checkChoice({"self", "off"}));
  table.text(
      "--tls-certificate", options.tls.certificate, "FILE",
      "PEM file with the certificate of the server and the chain to its authority. Turns TLS on. SIGHUP "
      "reads it again");
  table.text("--tls-key", options.tls.key, "FILE", "PEM file with the private key of that certificate");
  table.text("--tls-client-ca", options.tls.clientCa, "FILE",
             "PEM file of authorities: clients with a certificate must have it from one of these. Clients "
             "without one are accepted");
}

// Checks the options together.
void checkTls(const TlsOptions& tls) {
  if (tls.certificate.empty() != tls.key.empty())
    throw OptionError("--tls-certificate and --tls-key belong together: give both");
  if (tls.self && !tls.certificate.empty())
    throw OptionError("--tls self excludes --tls-certificate: use one of them");
  if (!tls.clientCa.empty() && !tls.self && tls.certificate.empty())
    throw OptionError("--tls-client-ca needs TLS: add --tls-certificate and --tls-key, or --tls self");
}

void addDeviceOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.text("--device", options.server.device.select, "DEVICE",
             "Index of a Vulkan device, or part of its name. By default the best device is used");
  table.number("--software-threads", options.server.device.softwareThreads, kThreads,
               "Threads of a software device in addition to the waiting one. By default chosen for --scene");
  table.text(
      "--kernels", parsed.kernels, "KIND",
      "Settings of the kernels: gpu, cpu, or auto: cpu for a software device. States have the same bits",
      checkChoice({"auto", "cpu", "gpu"}));
  table.showDefault(table.text("--cache-dir", options.server.device.cacheDirectory, "DIR",
                               "Directory for compiled kernels; '' disables the cache"),
                    "$XDG_CACHE_HOME/clothstream or $HOME/.cache/clothstream");
}

void addProgramOptions(OptionTable& table, Parsed& parsed) {
  table.group("Program");
  table.text("--log-level", parsed.options.log.level, "LEVEL", "trace, debug, info, warning, error or off",
             checkChoice({"trace", "debug", "info", "warning", "error", "off"}, {"warn", "err", "critical"}));
  table.text("--log-format", parsed.options.log.format, "FORMAT",
             "text, or json: one JSON object per line of the log", checkChoice({"text", "json"}));
  table.number("--seconds", parsed.options.serve.stopAfter,
               {.min = 0, .max = 1e9, .type = "SECONDS", .aboveMin = true}, "Stop after this time");
  table.number(
      "--drain", parsed.options.serve.server.drain, {.min = 0.1, .max = 600, .type = "SECONDS"},
      "Seconds after SIGINT or SIGTERM within which the server ends, even if the device or the disk does "
      "not answer. A second signal ends it at once");
  parsed.stateDirectory = table.text(
      "--state-dir", parsed.options.serve.state.directory, "DIR",
      "Directory of what the server keeps for its next start: the key of --tls self and, if this option is "
      "given, scenes with their states and participants");
  table.showDefault(parsed.stateDirectory, "$XDG_STATE_HOME/clothstream or $HOME/.local/state/clothstream");
  table.number(
      "--state-limit", parsed.options.serve.state.limitMb, {.min = 0, .max = 1e9, .type = "MEGABYTES"},
      "Megabytes of the kept scenes. Beyond it the states of the largest scenes are left out. 0 means no "
      "limit");
  table.text("--config", parsed.config, "FILE", "Read options from this TOML file");
  table.action("--print-config", parsed.printConfig, "Print the effective options as a TOML file, and exit");
  table.action("--help-markdown", parsed.printMarkdown, "Print this help as a page of Markdown, and exit");
}

void addFleetOptions(OptionTable& table, Parsed& parsed) {
  ServeOptions& options = parsed.options.serve;
  table.group("Other servers");
  CLI::Option* servers = table.list(
      "--nats", options.nats.servers, "URL",
      "Offer the scenes of this server to edge servers through NATS, such as nats://10.0.0.5:4222; may "
      "be repeated, or a comma-separated list. Built-in scenes other than --scene are not offered");
  servers->delimiter(',')->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  table.text("--nats-credentials", options.nats.credentials, "FILE",
             "Credentials of this server for NATS (JWT and seed)");
  table.text("--nats-ca", options.nats.authority, "FILE",
             "Require TLS for NATS, with a certificate of an authority in this PEM file");
  table.flag("--agones", parsed.isGameServer,
             "Be a game server of Agones in Kubernetes: tell its sidecar, at the port AGONES_SDK_HTTP_PORT "
             "(9358), that "
             "the server is ready, healthy or in use, and what it carries");
  table.text("--events-url", options.webhook.url, "URL",
             "Report who joins and leaves scenes, and what scenes use, to this webhook of a backend, such as "
             "https://backend.example.org/cloth. With http:// everyone on the way can read the events",
             [](const std::string& text) {
               const auto url = events::parseUrl(text);
               return url || text.empty() ? std::string() : url.error();
             });
  table.text("--events-secret-file", options.webhook.secret, "FILE",
             "Secret that signs the events: whsec_ and the base64 of 24 to 64 random bytes");
}

// Checks the options together.
void checkWebhook(const WebhookOptions& webhook) {
  if (!webhook.url.empty() && webhook.secret.empty())
    throw OptionError("--events-url needs a secret that signs the events: add --events-secret-file FILE");
  if (webhook.url.empty() && !webhook.secret.empty())
    throw OptionError("--events-secret-file has no effect without --events-url URL: give both");
}

void checkNats(const NatsOptions& nats) {
  for (const std::string& url : nats.servers)
    if (!url.starts_with("nats://") && !url.starts_with("tls://"))
      throw OptionError(
          fmt::format("--nats: '{}' begins with neither nats:// nor tls://; use nats://HOST:4222", url));
}

// Port of the sidecar. Throws OptionError.
std::uint16_t agonesPort() {
  constexpr std::uint16_t kDefaultPort = 9358;
  const char* const text = std::getenv("AGONES_SDK_HTTP_PORT");
  if (text == nullptr || *text == '\0') return kDefaultPort;
  std::uint16_t port = 0;
  const std::string_view whole(text);
  const auto [rest, error] = std::from_chars(whole.data(), whole.data() + whole.size(), port);
  if (error != std::errc() || rest != whole.data() + whole.size() || port == 0)
    throw OptionError(
        fmt::format("AGONES_SDK_HTTP_PORT: '{}' is not a port; Agones sets it to 1 to 65535", whole));
  return port;
}

CLI::App& addEdgeCommand(OptionTable& table) {
  CLI::App& command = table.command("edge", "Serve scenes of other servers to more viewers. Needs no device");
  command.footer(
      "Options of clothstream-server for participants, network and log apply too; --nats is required, and\n"
      "--scene is the default scene: without it, clients that name none get the first one.");
  command.fallthrough();
  return command;
}

CLI::App& addPrintSceneCommand(OptionTable& table, std::string& nameOrPath) {
  CLI::App& command = table.command(
      "print-scene", "Print a scene as JSON, with all defaults and the geometry of its meshes filled in");
  table.word("SCENE", nameOrPath, "Name of a scene, or a JSON file");
  return command;
}

CLI::App& addStepCommand(OptionTable& table, Parsed& parsed) {
  StepOptions& options = parsed.options.step;
  CLI::App& command =
      table.command("step", "Run a scene without clock or network, and write its states to a file");
  table.text("--scene", options.scene, "NAME", "Name of a scene, or a JSON file")
      ->required()
      ->default_str("");
  table.showDefault(command.get_option("--scene"), "");
  table.number("--ticks", options.run.ticks, kTicks, "Number of ticks")->required()->default_str("");
  table.showDefault(command.get_option("--ticks"), "");
  table.text("--out", options.run.out, "FILE", "Output file; FILE.json describes it")->required();
  table.number("--every", options.run.every, kTicks, "Write one state per this many ticks, from the start");
  table.number("--rate", options.rate, kRate, "Ticks per second, instead of the scene's own rate");
  table.number("--substeps", options.substeps, kSubsteps,
               "Integration steps per tick, instead of the scene's own number");
  addDeviceOptions(table, parsed);
  command.footer(fmt::format(
      "The file holds frames of little-endian float32, six per node: position and velocity. FILE.json has "
      "the\n"
      "shape of the array, and reports of the simulation. In Python:\n"
      "  numpy.fromfile(FILE, '<f4').reshape(json.load(open(FILE + '.json'))['shape'])\n"
      "Exit code: 0 if all ticks ran, 1 for an error or a state with infinite or undefined numbers, {} if\n"
      "interrupted.",
      kInterrupted));
  return command;
}

CLI::App& addDoctorCommand(OptionTable& table, Parsed& parsed) {
  DoctorOptions& options = parsed.options.doctor;
  CLI::App& command = table.command(
      "doctor", "Check the device, the machine and the configuration of a server, and say what to do");
  table.number("--seconds", options.seconds, kDoctorSeconds,
               "Time for measuring the sizes of cloth that the device carries. 0 leaves it out");
  table.flag("--accept", options.accepts,
             "Also simulate a thousand ticks of each built-in scene, and compare the states with those that "
             "every device must reach. Takes about a quarter of an hour on two processors");
  table.text("--report", options.report, "FILE", "Write the findings to this file, as JSON");
  table.flag("--json", options.json, "Print the findings as JSON");
  command.footer(
      fmt::format("Options of the server come before the command: clothstream-server --config FILE doctor.\n"
                  "Exit code: 0 without problems, 1 with problems, {} if interrupted.",
                  kInterrupted));
  return command;
}

void addRecordingLimits(OptionTable& table, recording::ReadLimits& limits) {
  table.number(
      "--max-vertices", limits.vertices, {.min = 1, .max = codec::kMaxVertices},
      "Most vertices of the recording, and half of its most triangles, since the file decides how much "
      "memory is needed");
}

CLI::App& addResimulateCommand(OptionTable& table, Parsed& parsed) {
  ResimulateOptions& options = parsed.options.resimulate;
  CLI::App& command =
      table.command("resimulate", "Simulate a recording again, and compare each state with the recorded one");
  table.word("FILE", options.recording, "Recording that --record wrote");
  table.text("--states", options.states, "OUT",
             "Write positions and velocities of every tick to this file, in the format of `step`");
  table.flag("--json", options.json, "Print the result as one JSON object");
  addRecordingLimits(table, options.limits);
  addDeviceOptions(table, parsed);
  command.footer(
      fmt::format("Exit code: 0 if every state is bitwise equal, 1 for other bits although the kernels are "
                  "not known to be\n"
                  "other ones, 2 for wrong arguments, 6 if OUT cannot be written, 7 if FILE cannot be read "
                  "or simulated, 8 if\n"
                  "the program itself fails, 9 for other bits from other kernels, 10 if nothing differs but "
                  "a part is missing,\n"
                  "{} if interrupted.",
                  kInterrupted));
  return command;
}

constexpr NumberRange kSpeedRange{.min = recording::kMinSpeed, .max = recording::kMaxSpeed};
constexpr const char* kMaxSpeedWord = "max";
constexpr double kMaxSeed = std::numeric_limits<std::uint32_t>::max();

CLI::App& addPlayCommand(OptionTable& table, Parsed& parsed) {
  PlayOptions& options = parsed.options.play;
  CLI::App& command =
      table.command("play", "Serve a recording as a scene that clients join, pause, seek, speed up and loop");
  table.word("FILE", options.recording, "Recording that --record or `clothstream record` wrote");
  table.number("--from", options.playback.from, {.min = 0, .type = "SECONDS"},
               "Start this many seconds after the beginning");
  table.text(
      "--speed", parsed.playSpeed, "N|max",
      "Recorded seconds per second, 0.1 to 8. In lockstep also max: as fast as frames are acknowledged",
      [](const std::string& text) {
        return text == kMaxSpeedWord ? std::string() : checkNumber(kSpeedRange, false)(text);
      });
  table.flag("--loop", options.playback.loop, "Continue from the beginning at the end, instead of pausing");
  table.flag("--lockstep", options.playback.lockstep,
             "Send the next frame when all participants have acknowledged the last one");
  table.number("--wait-for", options.playback.waitFor, {.min = 1, .max = hosting::kMaxParticipants},
               "Participants that must be there before the first frame");
  table.number("--faults", options.playback.faults, {.min = 0, .max = kMaxSeed, .type = "SEED"},
               "Drop and delay frames. The same seed gives the same faults");
  addRecordingLimits(table, options.limits);
  command.footer(
      "Options of clothstream-server for participants, network and log apply too. No device is needed.");
  command.fallthrough();
  return command;
}

double playbackSpeed(const std::string& text, bool lockstep) {
  if (text == kMaxSpeedWord) {
    if (!lockstep) throw OptionError("--speed: max requires --lockstep; use 0.1 to 8 without it");
    return recording::kUnpaced;
  }
  double speed = 1;
  std::from_chars(text.data(), text.data() + text.size(), speed);
  return speed;
}

// Seconds in a text such as 90s, 30m, 8h and 7d; nothing for others.
std::optional<std::chrono::seconds> parseTime(const std::string& text) {
  constexpr std::chrono::seconds kMost = std::chrono::hours(24 * 3650);
  std::int64_t number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view unit(rest, static_cast<std::size_t>(text.data() + text.size() - rest));
  const std::map<std::string_view, std::int64_t> units{{"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86'400}};
  const auto known = units.find(unit);
  if (error != std::errc() || known == units.end() || number < 1 || number > kMost.count() / known->second)
    return std::nullopt;
  return std::chrono::seconds(number * known->second);
}

CLI::App& addTokenCommand(OptionTable& table, Parsed& parsed) {
  TokenOptions& token = parsed.options.token;
  CLI::App& command = table.command("token", "Print a token for a client, or make a key that signs tokens");
  CLI::Option* key = table.text("--key", token.key, "FILE",
                                "Private key NAME.pem, or secret NAME.secret, of --token-keys that signs it");
  table.exclude(key, table.text("--new-key", token.newKey, "FILE",
                                "Make this key instead: NAME.pem for ES256, NAME.secret for HS256"));
  table.text("--scene", token.scene, "NAME", "Only scene that the client may use. By default all scenes");
  table.showDefault(
      table.choice("--role", parsed.tokenRole, kRoles, "Highest role: viewer, participant or owner"),
      "participant");
  table.text("--name", token.name, "NAME", "Name that other participants see");
  table.text("--subject", token.subject, "ID",
             "Person or program; bans and limits of connections hold for it");
  table.text("--tenant", token.tenant, "ID", "Group whose created scenes are counted together");
  table.text("--valid", parsed.tokenValid, "TIME", "Time from now, such as 90s, 30m, 8h or 7d; at most 3650d",
             [](const std::string& text) {
               return parseTime(text) ? std::string()
                                      : fmt::format("'{}' is not a time; use 90s, 30m, 8h or 7d", text);
             });
  table.text("--token-audience", parsed.options.serve.identity.tokenAudience, "NAME",
             "Audience (aud), as for the server");
  return command;
}

std::string configFile(const Parsed& parsed) {
  const char* fromEnvironment = std::getenv("CLOTHSTREAM_CONFIG");
  return parsed.config.empty() && fromEnvironment != nullptr ? fromEnvironment : parsed.config;
}

scene::Permissions toPermissions(const std::vector<std::string>& changeable) {
  const auto has = [&](const char* what) { return std::ranges::find(changeable, what) != changeable.end(); };
  if (has("none") && changeable.size() > 1)
    throw OptionError("--participants-change: 'none' excludes the other values; use it alone");
  return {has("environment"), has("cloths"), has("colliders")};
}

// Adds what --participants-may allows.
void allow(const std::vector<std::string>& allowed, scene::Permissions& permissions) {
  const auto has = [&](const char* what) { return std::ranges::find(allowed, what) != allowed.end(); };
  if (has("none") && allowed.size() > 1)
    throw OptionError("--participants-may: 'none' excludes the other values; use it alone");
  permissions.create = has("create");
  permissions.remove = has("delete");
  permissions.control = has("control");
  permissions.record = has("record");
  permissions.own = has("own");
}

// Gives the server the limits of the profile, and those that an option sets alone. Such an option that is not
// given has the value of the profile.
void setLimits(Parsed& parsed) {
  hosting::ServerOptions& server = parsed.options.serve.server;
  hosting::Limits& limits = server;
  limits = hosting::Limits(parsed.profile());
  const double lifetime = std::chrono::duration<double>(limits.sceneLifetime).count();
  parsed.sceneLifetimeOption->default_str(fmt::format("{}", lifetime));
  parsed.maxUploadOption->default_str(fmt::format("{}", static_cast<double>(limits.maxUploadBytes) / 1e6));
  parsed.ownersAloneOption->default_str(limits.outsideControl ? "false" : "true");
  limits.sceneLifetime = parsed.sceneLifetime.value_or(limits.sceneLifetime);
  if (parsed.maxUploadMb) limits.maxUploadBytes = static_cast<std::uint64_t>(*parsed.maxUploadMb * 1e6);
  if (parsed.ownersAloneOption->count() > 0) limits.outsideControl = !parsed.ownersAlone;
  server.budget.sceneLoad = limits.sceneShare * server.budget.load;
  server.budget.sceneMegabytes = limits.sceneShare * server.budget.megabytes;
}

// Errors name what replaces an option that the server no longer has.
void retireOptions(OptionTable& table) {
  table.retire({"rate", "substeps", "max-error", "normals", "qualities"},
               "set it in a scene file (--scene-file)");
  table.retire({"max-scene-nodes", "max-scene-springs", "max-node-springs", "max-scene-attachments",
                "max-creation-time", "max-scene-load", "max-scene-memory", "max-participants-per-address",
                "max-connections-per-token", "max-connections-per-address", "connections-per-second",
                "connections-per-second-per-address", "hello-timeout", "max-read-rate", "max-upload-time",
                "min-upload-rate", "max-upload-memory-per-address", "max-parsed-memory", "log-rate"},
               "use --profile, which sets this limit");
}

void printMarkdown(const OptionTable& table) {
  fmt::print(
      "# Options of clothstream-server\n\n"
      "Generated by `clothstream-server --help-markdown`; a test compares this page with the program.\n\n"
      "An option has one name and three sources. The stronger source wins:\n\n"
      "1. the command line: `--grpc-port 50052`;\n"
      "2. the environment: `CLOTHSTREAM_GRPC_PORT=50052`. Lists are separated by commas; an empty variable "
      "is ignored;\n"
      "3. a TOML file named by `--config` or `CLOTHSTREAM_CONFIG`: `grpc-port = 50052`. Lists are arrays, "
      "flags are\n"
      "   `true` or `false`.\n\n"
      "`clothstream-server --print-config` prints the effective options as such a file. An unknown key of "
      "the file is\n"
      "an error. An unknown variable that starts with `CLOTHSTREAM_` is a warning. Options of commands (last "
      "sections)\n"
      "come from the command line only. In Kubernetes, set `enableServiceLinks: false`: a service named "
      "`clothstream`\n"
      "would otherwise define `CLOTHSTREAM_PORT`.\n"
      "{}{}",
      profilesAsMarkdown(), table.toMarkdown());
}

}  // namespace

bool isLoopback(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  constexpr std::uint32_t kLoopbackNet = 127;
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
  if (::inet_pton(AF_INET6, host.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6) != 0;
  return host == "localhost";
}

bool isReachable(const NetworkOptions& network) {
  return !isLoopback(network.host) || !network.publicNames.empty();
}

std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv) {
  Parsed parsed;
  ProgramOptions& options = parsed.options;
  ServeOptions& serve = options.serve;
  serve.server.defaultScene = "veil";
  serve.server.serverName = kServerName;
  serve.server.device.cacheDirectory = userDirectory("XDG_CACHE_HOME", ".cache");
  serve.state.directory = userDirectory("XDG_STATE_HOME", ".local/state");

  CLI::App app{"Simulates cloth with Vulkan and streams it to browsers and gRPC clients.",
               "clothstream-server"};
  app.set_version_flag("--version", kServerName);
  app.get_formatter()->column_width(34);
  app.footer(fmt::format(
      "Options may also come from a TOML file (--config FILE, grpc-port = 50052) or from the environment\n"
      "(CLOTHSTREAM_GRPC_PORT=50052). The command line wins over the environment, the environment over the "
      "file.\n\n{}",
      profilesAsText()));
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);  // scripts append to defaults
  OptionTable table(app);
  addSceneOptions(table, parsed);
  addParticipantOptions(table, parsed);
  addIdentityOptions(table, parsed);
  addNetworkOptions(table, parsed);
  addLimitOptions(table, parsed);
  addTlsOptions(table, parsed);
  addFleetOptions(table, parsed);
  table.group("Device");
  addDeviceOptions(table, parsed);
  table.action("--list-devices", parsed.listDevices, "List the Vulkan devices, and exit");
  addProgramOptions(table, parsed);
  retireOptions(table);
  const CLI::App& printScene = addPrintSceneCommand(table, options.printScene);
  const CLI::App& step = addStepCommand(table, parsed);
  const CLI::App& resimulate = addResimulateCommand(table, parsed);
  const CLI::App& play = addPlayCommand(table, parsed);
  const CLI::App& edge = addEdgeCommand(table);
  const CLI::App& token = addTokenCommand(table, parsed);
  const CLI::App& doctor = addDoctorCommand(table, parsed);
  // For `resimulate`, 1 means a difference.
  const auto wrongArguments = [&] { return resimulate.parsed() ? recording::kWrongArguments : 1; };

  try {
    app.parse(argc, argv);
    options.warnings = table.applySources(environ, configFile(parsed));
    if (!parsed.changeable.empty()) serve.server.participantsMay = toPermissions(parsed.changeable);
    serve.tls.self = parsed.tls == "self";
    serve.server.device.kernels = parsed.kernels == "gpu"   ? vulkan::KernelSettings::gpu
                                  : parsed.kernels == "cpu" ? vulkan::KernelSettings::cpu
                                                            : vulkan::KernelSettings::automatic;
    serve.state.keepsScenes = parsed.stateDirectory->count() > 0 && !serve.state.directory.empty();
    checkTls(serve.tls);
    checkWebhook(serve.webhook);
    checkNats(serve.nats);
    const std::string way = CLI::detail::to_lower(parsed.transport);
    serve.network.datagrams = way == "datagrams" ? DatagramUse::required
                              : way == "tcp"     ? DatagramUse::off
                                                 : DatagramUse::automatic;
    serve.network.announces = parsed.announce == "on" || (parsed.announce == "auto" && serve.tls.self &&
                                                          !isLoopback(serve.network.host));
    setLimits(parsed);
    allow(parsed.allowed, serve.server.participantsMay);
    serve.identity.anonymousRole = parsed.anonymousRole.value_or(serve.identity.anonymousRole);
    options.token.role = parsed.tokenRole.value_or(options.token.role);
    options.play.playback.speed = playbackSpeed(parsed.playSpeed, options.play.playback.lockstep);
    options.token.valid = parseTime(parsed.tokenValid).value_or(std::chrono::hours(8));
    const bool serves = app.get_subcommands().empty() || play.parsed() || edge.parsed();
    if (serves && !parsed.printConfig && !parsed.printMarkdown && !parsed.listDevices &&
        !parsed.listMaterials)
      checkIdentity(serve.identity, serve.network);
    if (parsed.isGameServer) serve.agonesPort = agonesPort();
    if (edge.parsed() && serve.nats.servers.empty())
      throw OptionError("edge: --nats URL is missing: the NATS servers that the other servers use");
    if (edge.parsed() && app.get_option("--scene")->count() == 0) serve.server.defaultScene.clear();
    if (token.parsed() && options.token.key.empty() && options.token.newKey.empty())
      throw OptionError("token: give --key FILE to print a token, or --new-key FILE to make a key");
  } catch (const CLI::ExtrasError&) {
    fmt::print(stderr, "{}\nRun with --help for more information.\n",
               table.unexpected(app.remaining(true).front()));
    return wrongArguments();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : wrongArguments();
  } catch (const OptionError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return wrongArguments();
  }
  if (parsed.printConfig) return fmt::print("{}{}", table.toToml(), limitsAsComments(parsed.profile())), 0;
  if (parsed.printMarkdown) return printMarkdown(table), 0;

  options.log.level = CLI::detail::to_lower(options.log.level);
  options.log.format = CLI::detail::to_lower(options.log.format);
  serve.server.roomSurfaces = parsed.roomSurfaces.value_or(serve.server.roomSurfaces);
  serve.server.adaptsToLoad = CLI::detail::to_lower(parsed.overload) == "adapt";
  serve.record.onRequest = !parsed.recordings.empty();
  serve.record.directory = serve.record.onRequest ? parsed.recordings : parsed.record;
  options.command = step.parsed()          ? Command::step
                    : play.parsed()        ? Command::play
                    : edge.parsed()        ? Command::edge
                    : resimulate.parsed()  ? Command::resimulate
                    : printScene.parsed()  ? Command::printScene
                    : token.parsed()       ? Command::token
                    : doctor.parsed()      ? Command::doctor
                    : parsed.listDevices   ? Command::listDevices
                    : parsed.listMaterials ? Command::listMaterials
                                           : Command::serve;
  return options;
}

}  // namespace clothstream
