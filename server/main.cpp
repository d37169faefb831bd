// SPDX-License-Identifier: MIT
// clothstream-server: simulates scenes on a Vulkan device and serves them through two endpoints.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/discovery/announcement.h"
#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/identity/authenticator.h"
#include "server/identity/token.h"
#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/model/material.h"
#include "server/monitoring/monitoring_endpoint.h"
#include "server/options/program_options.h"
#include "server/recording/playback.h"
#include "server/recording/recordings.h"
#include "server/recording/resimulate.h"
#include "server/saved_state/saved_state.h"
#include "server/simulation/software_threads.h"
#include "server/step/step.h"
#include "server/telemetry/log.h"
#include "server/tls/certificate.h"
#include "server/tls/qr_code.h"
#include "server/tls/server_tls.h"
#include "server/vulkan/device.h"

namespace clothstream {
namespace {

// Blocks SIGINT, SIGTERM, SIGHUP, SIGUSR1 and SIGUSR2 in every thread; wait() takes them. Must be created
// before any other thread.
class Signals {
 public:
  Signals() {
    sigemptyset(&set_);
    sigemptyset(&ending_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2}) sigaddset(&set_, signal);
    for (const int signal : {SIGINT, SIGTERM}) sigaddset(&ending_, signal);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
    std::signal(SIGPIPE, SIG_IGN);  // a closed peer is reported as an error of its socket
    std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is reported like a full disk
  }

  // Returns the next signal.
  int wait() const { return std::max(0, sigwaitinfo(&set_, nullptr)); }
  // Returns the next signal, or 0 after `timeout`.
  int wait(std::chrono::nanoseconds timeout) const { return wait(set_, timeout); }
  // Returns whether SIGINT or SIGTERM came within `timeout`. Leaves other signals for wait().
  bool waitForEnd(std::chrono::nanoseconds timeout) const { return wait(ending_, timeout) != 0; }

 private:
  static int wait(const sigset_t& set, std::chrono::nanoseconds timeout) {
    const auto wholeSeconds = std::chrono::duration_cast<std::chrono::seconds>(timeout);
    const timespec limit{static_cast<std::time_t>(wholeSeconds.count()),
                         static_cast<long>((timeout - wholeSeconds).count())};
    return std::max(0, sigtimedwait(&set, nullptr, &limit));
  }

  sigset_t set_{}, ending_{};
};

using SteadyTime = std::chrono::steady_clock::time_point;

// Interval in which the guards look for signals.
constexpr std::chrono::milliseconds kGuardInterval{20};

// Ends the process. The kernel closes files and connections; recordings stay readable.
[[noreturn]] void endNow(const char* why) {
  spdlog::error("ending at once: {}", why);
  spdlog::default_logger()->flush();
  std::_Exit(1);
}

// Takes SIGINT and SIGTERM while the server starts. Ends the process if the start goes on for `drain` after
// the first of them, or at the second one.
class StartGuard {
 public:
  StartGuard(const Signals& signals, std::chrono::nanoseconds drain)
      : thread_([this, &signals, drain](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            const bool signalled = signals.waitForEnd(kGuardInterval);
            if (signalled && stopAt_) endNow("another signal came");
            if (signalled) {
              spdlog::info("stopping when the start is complete, or after {} s (--drain)",
                           std::chrono::duration<double>(drain).count());
              stopAt_ = std::chrono::steady_clock::now() + drain;
            }
            if (stopAt_ && std::chrono::steady_clock::now() >= *stopAt_) endNow("the start takes too long");
          }
        }) {}

  // Call it when the start is complete. Returns when the process must have ended, if SIGINT or SIGTERM came.
  std::optional<SteadyTime> finish() {
    thread_ = {};
    return stopAt_;
  }

 private:
  std::optional<SteadyTime> stopAt_;  // belongs to the thread until finish()
  std::jthread thread_;
};

// Ends the process while it lives: when the time is over, or at the next SIGINT or SIGTERM.
class EndGuard {
 public:
  EndGuard(const Signals& signals, SteadyTime end)
      : thread_([&signals, end](const std::stop_token& stop) {
          while (std::chrono::steady_clock::now() < end && !stop.stop_requested())
            if (signals.waitForEnd(kGuardInterval)) endNow("another signal came");
          if (!stop.stop_requested()) endNow("the device or the disk does not answer");
        }) {}

 private:
  std::jthread thread_;
};

// `nodes` is the size of the scene that the device will simulate.
vulkan::DeviceOptions deviceOptions(const ProgramOptions& options, std::uint32_t nodes) {
  return simulation::suitedTo(nodes, options.server.device);
}

std::string describe(const vulkan::DeviceInfo& device) {
  constexpr const char* kKinds[] = {"discrete GPU", "integrated GPU", "virtual GPU", "software", "other"};
  return fmt::format("{} ({}, {}, Vulkan {})", device.name, kKinds[static_cast<std::size_t>(device.kind)],
                     device.driver, device.apiVersion);
}

int listDevices() {
  for (const vulkan::DeviceInfo& device : vulkan::listDevices())
    fmt::print("{}  {}\n", device.index, describe(device));
  return 0;
}

int listMaterials() {
  fmt::print("{:<12}{:>8}{:>10}{:>8}{:>10}  {}\n", "", "kg/m^2", "N/m", "shear", "uN m", "");
  for (const model::Material& material : model::materials())
    fmt::print("{:<12}{:>8}{:>10}{:>8}{:>10.3g}  {}\n", material.name, material.arealMass, material.tension,
               material.shear, 1e6 * double{material.rigidity}, material.description);
  return 0;
}

model::Scene loaded(messages::Result<model::Scene> scene) {
  if (!scene) throw std::runtime_error(scene.error().text);
  return std::move(*scene);
}

// The largest stream rate that divides the new simulation rate and is not above the scene's own.
std::uint32_t streamRateFor(const model::Scene& scene, std::uint32_t rate) {
  std::uint32_t streamRate = std::min(scene.streamRate, rate);
  while (rate % streamRate != 0) --streamRate;
  return streamRate;
}

model::Scene adjusted(model::Scene scene, const ProgramOptions& options) {
  if (options.rate) {
    scene.streamRate = streamRateFor(scene, *options.rate);
    scene.simulationRate = *options.rate;
  }
  scene.substeps = options.substeps.value_or(scene.substeps);
  scene.stream.maxError = options.maxError.value_or(scene.stream.maxError);
  scene.stream.normals = options.normals.value_or(scene.stream.normals);
  scene.stream.coding = options.coding.value_or(scene.stream.coding);
  if (options.temporalLayers)
    scene.stream.temporalLayers = static_cast<std::uint8_t>(*options.temporalLayers);
  if (options.qualities) scene.stream.qualities = static_cast<std::uint8_t>(*options.qualities);
  auto checked = messages::toScene(messages::toMessage(scene));
  if (!checked)
    throw std::runtime_error(
        fmt::format("scene '{}' with these options: {}", scene.name, checked.error().text));
  return std::move(*checked);
}

// Built-in scenes and those from files. A file replaces a built-in scene of the same name. `builtIn` gets the
// names of those that are not replaced.
std::vector<model::Scene> loadScenes(const ProgramOptions& options, std::vector<std::string>& builtIn) {
  builtIn = messages::namedScenes();
  std::vector<model::Scene> scenes;
  for (const std::string& name : messages::namedScenes()) scenes.push_back(loaded(messages::loadScene(name)));
  for (const std::filesystem::path& file : options.sceneFiles) {
    model::Scene scene = loaded(messages::readSceneFile(file));
    std::erase_if(scenes, [&](const model::Scene& other) { return other.name == scene.name; });
    std::erase(builtIn, scene.name);
    scenes.push_back(std::move(scene));
  }
  for (model::Scene& scene : scenes)
    if (scene.name == options.server.defaultScene) scene = adjusted(std::move(scene), options);
  return scenes;
}

// Directory of the page in a build or an installation, relative to the program. Empty if it does not exist.
std::filesystem::path pageNextToProgram() {
  const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  for (const char* place : {"../web", "../share/clothstream/web"})
    if (const auto page = programs / place; std::filesystem::exists(page / "index.html"))
      return page.lexically_normal();
  return {};
}

// Address under which a client on this machine reaches the endpoint.
std::string localAddress(const std::string& host, std::uint16_t port) {
  if (host == "0.0.0.0") return fmt::format("127.0.0.1:{}", port);
  if (host == "::") return fmt::format("[::1]:{}", port);
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

// Names and addresses that a certificate of the server's own has.
std::vector<std::string> namesOf(const ProgramOptions& options) {
  std::vector<std::string> names = tls::namesOfThisMachine();
  for (const std::string& name : options.publicNames)
    if (name != "*") names.push_back(name);
  return names;
}

// Null without TLS.
std::shared_ptr<tls::ServerTls> openTls(const ProgramOptions& options) {
  std::string clientCa;
  if (!options.tlsClientCa.empty()) clientCa = tls::readCertificates(options.tlsClientCa);
  if (options.tlsSelf) {
    if (options.stateDirectory.empty())
      throw std::runtime_error("--tls self needs a directory for its key: use --state-dir DIR");
    return std::make_shared<tls::ServerTls>(
        [directory = options.stateDirectory / "tls", names = namesOf(options)] {
          return tls::selfSigned(directory, names);
        },
        std::move(clientCa));
  }
  if (options.tlsCertificate.empty()) return nullptr;
  if (tls::othersMayRead(options.tlsKey))
    spdlog::warn("--tls-key: other accounts of this machine may read {}; use chmod 600",
                 options.tlsKey.string());
  return std::make_shared<tls::ServerTls>(
      [chain = options.tlsCertificate, key = options.tlsKey] {
        tls::Certificate certificate = tls::readCertificate(chain, key);
        if (tls::expiryOf(certificate) < std::chrono::system_clock::now())
          spdlog::warn("the certificate in {} has expired; clients will refuse it", chain.string());
        return certificate;
      },
      std::move(clientCa));
}

void reload(tls::ServerTls& tls) {
  try {
    tls.reload();
    spdlog::info("the certificate is read again");
  } catch (const std::exception& failure) {
    spdlog::error("the old certificate stays in use: {}", failure.what());
  }
}

void reload(identity::Authenticator& authenticator) {
  try {
    authenticator.reload();
    spdlog::info("the keys of tokens are read again");
  } catch (const std::exception& failure) {
    spdlog::error("the old keys of tokens stay in use: {}", failure.what());
  }
}

// Null if every peer may act as an owner, because only programs of this machine reach the server.
std::shared_ptr<identity::Authenticator> makeAuthenticator(const ProgramOptions& options) {
  const bool asks = options.pairing || !options.tokenKeys.empty();
  if (!asks && !isReachable(options)) return nullptr;
  if (!asks && isLoopback(options.host))
    spdlog::warn(
        "--insecure: everyone who reaches {} through a program of this machine can join, and counts "
        "as a program of this machine (docs/identity.md)",
        options.publicNames.front());
  else if (!asks)
    spdlog::warn("--insecure: everyone who reaches {} can join, with the role {} (docs/identity.md)",
                 options.host, scene::nameOf(options.anonymousRole));
  if (asks && !isLoopback(options.host) && !options.tlsSelf && options.tlsCertificate.empty())
    spdlog::warn("tokens and pairing codes travel without encryption: add --tls self or --tls-certificate");
  return std::make_shared<identity::Authenticator>(
      identity::AuthenticatorOptions{.keyDirectory = options.tokenKeys,
                                     .audience = options.tokenAudience,
                                     .pairing = options.pairing,
                                     .stateDirectory = options.stateDirectory,
                                     .anonymousRole = options.anonymousRole});
}

// Makes a pairing code for an owner: a person who sees the output of the server controls it.
void printPairingCode(identity::Authenticator& authenticator) {
  const auto made = authenticator.makeCode(scene::Role::owner, schedule::Clock::now());
  if (!made) return;
  fmt::print("pair    {} makes an owner for {} minutes; SIGUSR2 shows a new code\n", made->code,
             identity::PairingCodes::kValid.count());
  std::fflush(stdout);
}

// The first address of this machine that others in its network can reach, or empty.
std::string addressInNetwork(const ProgramOptions& options) {
  if (isLoopback(options.host)) return {};
  if (options.host != "0.0.0.0" && options.host != "::") return options.host;
  for (const std::string& name : tls::namesOfThisMachine())
    if (name.find('.') != std::string::npos && name.find_first_not_of("0123456789.") == std::string::npos &&
        !name.starts_with("127."))
      return name;
  return {};
}

// Prints what a person needs to reach the page from another device: address, QR code and fingerprint.
void printHomeAddresses(const ProgramOptions& options, std::uint16_t port, const std::string& fingerprint) {
  fmt::print("key     {}\n", fingerprint);
  const std::string host = addressInNetwork(options);
  if (host.empty()) return;
  const std::string address = fmt::format("https://{}/", localAddress(host, port));
  fmt::print("type    {}\n{}", address, tls::qrCode(address));
}

// Returns after SIGINT, SIGTERM or --seconds, and after SIGHUP if there is neither TLS nor an authenticator.
// SIGHUP reloads the certificate and the keys of tokens, SIGUSR1 prints the report, SIGUSR2 a pairing code.
// `tls` and `authenticator` may be null.
void waitForStop(const Signals& signals, const ProgramOptions& options, tls::ServerTls* tls,
                 identity::Authenticator* authenticator, const std::function<std::string()>& report) {
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> end;
  if (options.stopAfter) end = Clock::now() + *options.stopAfter;
  while (!end || Clock::now() < *end) {
    const int signal = end ? signals.wait(*end - Clock::now()) : signals.wait();
    const bool reloads = tls != nullptr || authenticator != nullptr;
    if (signal == SIGINT || signal == SIGTERM || (signal == SIGHUP && !reloads)) return;
    if (signal == SIGHUP && tls != nullptr) reload(*tls);
    if (signal == SIGHUP && !options.tokenKeys.empty()) reload(*authenticator);
    try {
      if (signal == SIGUSR2 && options.pairing) printPairingCode(*authenticator);
      if (signal != SIGUSR1) continue;
      fmt::print("{}", report());
      std::fflush(stdout);
    } catch (const std::exception& failure) {  // such as a closed pipe or a lack of memory
      spdlog::error("printing after a signal failed: {}", failure.what());
    }
  }
}

// Opens the endpoint for operators, before the scenes are loaded, and prints its address. Null without
// --metrics-port.
std::unique_ptr<monitoring::MonitoringEndpoint> openMonitoring(const ProgramOptions& options) {
  if (!options.metricsPort) return nullptr;
  auto endpoint = std::make_unique<monitoring::MonitoringEndpoint>(
      monitoring::MonitoringOptions{.host = options.metricsHost,
                                    .port = *options.metricsPort,
                                    .version = CLOTHSTREAM_VERSION,
                                    .publicNames = options.publicNames});
  fmt::print("metrics http://{}/metrics\n", localAddress(options.metricsHost, endpoint->port()));
  std::fflush(stdout);
  return endpoint;
}

// Makes a server visible to the monitoring endpoint while the object lives.
class Monitored {
 public:
  // `endpoint` may be null.
  Monitored(monitoring::MonitoringEndpoint* endpoint, hosting::SceneServer& server) : endpoint_(endpoint) {
    if (endpoint_ != nullptr) endpoint_->started(server);
  }
  ~Monitored() {
    if (endpoint_ != nullptr) endpoint_->stopped();
  }
  Monitored(const Monitored&) = delete;
  Monitored& operator=(const Monitored&) = delete;

  void stopping() const {
    if (endpoint_ != nullptr) endpoint_->stopping();
  }

 private:
  monitoring::MonitoringEndpoint* const endpoint_;
};

// Serves through both endpoints until a signal or --seconds ends it. `intro` is printed before the addresses.
// `authenticator` and `monitoring` may be null. Returns what limits the time until the process ends.
[[nodiscard]] std::unique_ptr<EndGuard> openEndpoints(
    hosting::SceneServer& server, const ProgramOptions& options, const Signals& signals, StartGuard& start,
    identity::Authenticator* authenticator, monitoring::MonitoringEndpoint* monitoring,
    const std::string& intro, const std::function<std::string()>& report) {
  std::unique_ptr<EndGuard> guard;
  const std::shared_ptr<tls::ServerTls> tls = openTls(options);
  {
    const std::filesystem::path page = options.page.empty() ? pageNextToProgram() : options.page;
    if (page.empty())
      spdlog::warn("no page found next to the program: build the target clothstream_page, or use --page DIR");
    const endpoint::ConnectionLimits limits{
        .connectionsPerAddress = options.maxConnectionsPerAddress,
        .connectionsPerSecond = options.connectionsPerSecond,
        .connectionsPerSecondOfAddress = options.connectionsPerSecondPerAddress};
    const endpoint::WebEndpoint web(server, {.host = options.host,
                                             .port = options.port,
                                             .pageDirectory = page,
                                             .maxConnections = options.maxConnections,
                                             .connections = limits,
                                             .publicNames = options.publicNames,
                                             .tls = tls,
                                             .hostInNetwork = addressInNetwork(options),
                                             .showsFingerprint = options.tlsSelf,
                                             .allowedOrigins = options.allowedOrigins});
    const endpoint::GrpcEndpoint rpc(server, {.host = options.host,
                                              .port = options.grpcPort,
                                              .maxStreams = options.maxConnections,
                                              .connections = limits,
                                              .reflects = options.tokenKeys.empty() && !options.pairing,
                                              .tls = tls});

    fmt::print("{}page    http{}://{}/\ngRPC    {}{}\n", intro, tls ? "s" : "",
               localAddress(options.host, web.port()), tls ? "https://" : "",
               localAddress(options.host, rpc.port()));
    if (options.tlsSelf) printHomeAddresses(options, web.port(), tls->fingerprint());
    std::fflush(stdout);
    if (options.pairing) printPairingCode(*authenticator);
    const Monitored monitored(monitoring, server);
    std::optional<discovery::Announcement> announcement;
    if (options.announces)
      announcement.emplace(
          discovery::AnnouncedServer{.pagePort = web.port(),
                                     .grpcPort = rpc.port(),
                                     .encrypted = tls != nullptr,
                                     .fingerprint = options.tlsSelf ? tls->fingerprint() : "",
                                     .version = kServerName});
    const std::optional<SteadyTime> stopAt = start.finish();
    if (!stopAt) waitForStop(signals, options, tls.get(), authenticator, report);
    spdlog::info("stopping");
    guard = std::make_unique<EndGuard>(
        signals, stopAt.value_or(std::chrono::steady_clock::now() + options.server.drain));
    announcement.reset();
    monitored.stopping();
    server.stop();
  }
  fmt::print("{}", report());
  return guard;
}

int play(const ProgramOptions& options, const Signals& signals) {
  StartGuard start(signals, options.server.drain);
  const auto monitoring = openMonitoring(options);
  auto recording = recording::RecordedStream::open(options.recording);
  if (!recording) throw std::runtime_error(recording.error());
  if (options.playback.from > recording->length())
    throw std::runtime_error(fmt::format("--from: {} s is after the end of {}; use 0 to {:.3f}",
                                         options.playback.from, options.recording, recording->length()));
  if (recording->truncated())
    spdlog::warn("{} is truncated or damaged at its end; the readable part is played", options.recording);
  const std::string scene = recording->scene();
  const std::string intro = fmt::format("plays   {}, {:.1f} s of {}, recorded on {}\n", options.recording,
                                        recording->length(), scene, recording->device());
  std::unique_ptr<EndGuard> guard;  // outlives the server
  hosting::ServerOptions serverOptions = options.server;
  serverOptions.authenticator = makeAuthenticator(options);
  hosting::SceneServer server(
      scene, std::make_shared<recording::Playback>(std::move(*recording), options.playback), serverOptions);
  guard = openEndpoints(server, options, signals, start, serverOptions.authenticator.get(), monitoring.get(),
                        intro, [&] { return server.report(); });
  return 0;
}

std::uint64_t bytesOf(double megabytes) {
  return static_cast<std::uint64_t>(megabytes * 1e6);
}

int serve(const ProgramOptions& options, const Signals& signals) {
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
  if (options.keepsScenes)
    savedState = std::make_shared<saved_state::SavedState>(
        saved_state::SavedStateOptions{.directory = options.stateDirectory,
                                       .maxBytes = bytesOf(options.stateLimitMb),
                                       .minFreeBytes = bytesOf(options.keepFreeMb)});
  if (!options.recordDirectory.empty())
    recordings.emplace(
        recording::RecorderOptions{
            .directory = options.recordDirectory,
            .serverName = kServerName,
            .maxBytes = bytesOf(options.recordLimitMb),
            .disk = std::make_shared<recording::DiskShare>(
                options.recordDirectory, recording::DiskLimits{.maxBytes = bytesOf(options.recordingsLimitMb),
                                                               .minFreeBytes = bytesOf(options.keepFreeMb)})},
        !options.recordsOnRequest);
  const auto first = std::ranges::find(scenes, options.server.defaultScene, &model::Scene::name);
  const std::uint32_t nodes = first == scenes.end() ? 0 : first->nodeCount();
  hosting::ServerOptions serverOptions = options.server;
  serverOptions.device = deviceOptions(options, nodes);
  const std::shared_ptr<identity::Authenticator> authenticator = makeAuthenticator(options);
  serverOptions.authenticator = authenticator;
  serverOptions.journals = [&](const model::Scene& scene) {
    return recordings ? recordings->add(scene.name) : nullptr;
  };
  serverOptions.store = savedState;
  serverOptions.guestScenes = std::move(builtIn);
  hosting::SceneServer server(std::move(scenes), std::move(serverOptions));
  const auto report = [&] { return server.report() + (recordings ? recordings->report() : ""); };
  guard = openEndpoints(server, options, signals, start, authenticator.get(), monitoring.get(),
                        fmt::format("device  {}\nscenes  {}\n", describe(server.deviceInfo()), sceneList),
                        report);
  return 0;
}

bool isInterrupted(const Signals& signals) {
  const int signal = signals.wait(std::chrono::nanoseconds(0));
  return signal == SIGINT || signal == SIGTERM;
}

// Prints the completed share on standard error, at most once per second.
class Progress {
 public:
  void show(double part) {
    const Clock::time_point now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    fmt::print(stderr, "{:.0f} %\n", 100 * part);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(1);
};

int resimulate(const ProgramOptions& options, const Signals& signals) {
  Progress progress;
  const auto result =
      recording::resimulate({.path = options.recording,
                             .device = [&](std::uint32_t nodes) { return deviceOptions(options, nodes); },
                             .interrupted = [&] { return isInterrupted(signals); },
                             .progress = [&](double part) { progress.show(part); }});
  if (!result) throw std::runtime_error(result.error());
  fmt::print("{}", recording::toText(*result));
  if (result->interrupted) return kInterrupted;
  return result->firstDifferent || !result->missing.empty() ? 1 : 0;
}

int runSteps(const ProgramOptions& options, const Signals& signals) {
  const model::Scene scene = adjusted(loaded(messages::loadScene(options.server.defaultScene)), options);
  vulkan::Device device(deviceOptions(options, scene.nodeCount()));
  step::StepOptions stepOptions = options.step;
  stepOptions.serverName = kServerName;
  switch (step::run(device, scene, stepOptions, [&] { return isInterrupted(signals); })) {
    case step::Outcome::complete:
      return 0;
    case step::Outcome::interrupted:
      return kInterrupted;
    case step::Outcome::unhealthy:
      return 1;
  }
  return 1;
}

int printScene(const ProgramOptions& options) {
  fmt::print("{}\n", messages::toJson(loaded(messages::loadScene(options.printScene))));
  return 0;
}

int runToken(const ProgramOptions& options) {
  const TokenOptions& token = options.token;
  if (!token.newKey.empty()) {
    identity::makeTokenKey(token.newKey);
    return 0;
  }
  const identity::Claims claims{.role = token.role,
                                .scene = token.scene,
                                .name = token.name,
                                .subject = token.subject,
                                .tenant = token.tenant,
                                .audience = options.tokenAudience,
                                .expires = identity::WallClock::now() + token.valid,
                                .notBefore = {}};
  const identity::TokenKey key = identity::readTokenKey(token.key);
  const std::string text = identity::sign(key, claims);
  // A server would refuse names that are too long, for example.
  const auto checked =
      identity::check(text, {{key.id, key}}, options.tokenAudience, identity::WallClock::now());
  if (!checked) throw std::runtime_error(checked.error().text);
  fmt::print("{}\n", text);
  return 0;
}

int run(const ProgramOptions& options, const Signals& signals) {
  switch (options.command) {
    case Command::serve:
      return serve(options, signals);
    case Command::play:
      return play(options, signals);
    case Command::resimulate:
      return resimulate(options, signals);
    case Command::step:
      return runSteps(options, signals);
    case Command::printScene:
      return printScene(options);
    case Command::token:
      return runToken(options);
    case Command::listDevices:
      return listDevices();
    case Command::listMaterials:
      return listMaterials();
  }
  return 1;
}

}  // namespace
}  // namespace clothstream

int main(int argc, char** argv) {
  using namespace clothstream;
  try {
    const auto parsed = parseOptions(argc, argv);
    if (const int* code = std::get_if<int>(&parsed)) return *code;
    const ProgramOptions& options = std::get<ProgramOptions>(parsed);
    const Signals signals;
    telemetry::setUpLog(options.logLevel,
                        options.logFormat == "json" ? telemetry::LogFormat::json : telemetry::LogFormat::text,
                        options.logRate);
    for (const std::string& warning : options.warnings) spdlog::warn("{}", warning);
    return run(options, signals);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-server: %s\n", error.what());
    return 1;
  }
}
