// SPDX-License-Identifier: MIT
#include "server/program/endpoints.h"

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/agones/agones.h"
#include "server/discovery/announcement.h"
#include "server/endpoint/datagram/datagram_endpoint.h"
#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/endpoint/web/web_endpoint.h"
#include "server/program/addresses.h"
#include "server/program/authentication.h"
#include "server/program/monitoring.h"
#include "server/program/signal_work.h"
#include "server/program/tls.h"
#include "server/tls/qr_code.h"

namespace clothstream::program {
namespace {

// Quarters of --drain in which scenes may leave; the rest is for the end of the server.
constexpr int kLeaveShare = 3;

// Directory of the page in a build or an installation, relative to the program. Empty if it does not exist.
std::filesystem::path pageNextToProgram() {
  const std::filesystem::path programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  for (const char* place : {"../web", "../share/clothstream/web"})
    if (const auto page = programs / place; std::filesystem::exists(page / "index.html"))
      return page.lexically_normal();
  return {};
}

// Prints what a person needs to reach the page from another device: address, QR code and fingerprint.
void printHomeAddresses(const NetworkOptions& network, std::uint16_t port, const std::string& fingerprint) {
  fmt::print("key     {}\n", fingerprint);
  const std::string host = addressInNetwork(network);
  if (host.empty()) return;
  const std::string address = fmt::format("https://{}/", localAddress(host, port));
  fmt::print("type    {}\n{}", address, tls::qrCode(address));
}

// Null if datagrams are off, or if the port cannot be opened and they are not required.
std::unique_ptr<endpoint::DatagramEndpoint> openDatagrams(hosting::SceneServer& server,
                                                          const NetworkOptions& network) {
  if (network.datagrams == DatagramUse::off) return nullptr;
  try {
    return std::make_unique<endpoint::DatagramEndpoint>(server, datagramOptions(network));
  } catch (const std::exception& failure) {
    if (network.datagrams == DatagramUse::required)
      throw std::runtime_error(fmt::format("--transport datagrams: {}", failure.what()));
    spdlog::warn("{}; clients stay on their streams. --transport tcp says that this is meant",
                 failure.what());
    return nullptr;
  }
}

void print(const std::string& text) {
  fmt::print("{}", text);
  std::fflush(stdout);
}

// Returns after SIGINT, SIGTERM or --seconds, and after SIGHUP if there is neither TLS nor an authenticator.
// SIGHUP reloads the certificate and the keys of tokens, SIGUSR1 prints the report, SIGUSR2 a pairing code.
// Files are read and texts are printed elsewhere, so that SIGTERM is answered whatever they wait for. `tls`
// and `authenticator` may be null.
void waitForStop(const Signals& signals, const ServeOptions& options,
                 const std::shared_ptr<tls::ServerTls>& tls,
                 const std::shared_ptr<identity::Authenticator>& authenticator,
                 const std::function<std::string()>& report) {
  using Clock = std::chrono::steady_clock;
  SignalWork work;
  std::optional<Clock::time_point> end;
  if (options.stopAfter) end = Clock::now() + *options.stopAfter;
  while (!end || Clock::now() < *end) {
    const int signal = end ? signals.wait(*end - Clock::now()) : signals.wait();
    const bool reloads = tls != nullptr || authenticator != nullptr;
    if (signal == SIGINT || signal == SIGTERM || (signal == SIGHUP && !reloads)) return;
    if (signal == SIGHUP)
      work.post(signal, [tls, authenticator, readsKeys = !options.identity.tokenKeys.empty()] {
        if (tls) reload(*tls);
        if (readsKeys) reload(*authenticator);
      });
    else if (signal == SIGUSR1)
      work.post(signal, [text = report()] { print(text); });
    else if (signal == SIGUSR2 && options.identity.pairing)
      work.post(signal, [authenticator] { print(pairingCodeLine(*authenticator)); });
  }
}

}  // namespace

std::unique_ptr<EndGuard> openEndpoints(hosting::SceneServer& server, const ServeOptions& options,
                                        const Signals& signals, StartGuard& start,
                                        const std::shared_ptr<identity::Authenticator>& authenticator,
                                        monitoring::MonitoringEndpoint* monitoring, const std::string& intro,
                                        const std::function<std::string()>& report,
                                        const std::function<void(SteadyTime)>& leave) {
  std::unique_ptr<EndGuard> guard;
  const std::shared_ptr<tls::ServerTls> tls = openTls(options);
  {
    const std::filesystem::path page =
        options.network.page.empty() ? pageNextToProgram() : options.network.page;
    if (page.empty())
      spdlog::warn("no page found next to the program: build the target clothstream_page, or use --page DIR");
    const endpoint::ConnectionLimits limits{
        .connectionsPerAddress = options.server.connectionsPerAddress,
        .connectionsPerSecond = options.server.connectionsPerSecond,
        .connectionsPerSecondOfAddress = options.server.connectionsPerSecondPerAddress};
    // Outlives the sessions of both other endpoints, whose associations it has.
    const std::unique_ptr<endpoint::DatagramEndpoint> datagrams = openDatagrams(server, options.network);
    const endpoint::WebEndpoint web(server, {.host = options.network.host,
                                             .port = options.network.port,
                                             .pageDirectory = page,
                                             .maxConnections = options.network.maxConnections,
                                             .connections = limits,
                                             .publicNames = options.network.publicNames,
                                             .tls = tls,
                                             .hostInNetwork = addressInNetwork(options.network),
                                             .showsFingerprint = options.tls.self,
                                             .allowedOrigins = options.network.allowedOrigins});
    const endpoint::GrpcEndpoint rpc(server, {.host = options.network.host,
                                              .port = options.network.grpcPort,
                                              .maxStreams = options.network.maxConnections,
                                              .connections = limits,
                                              .reflects = options.network.reflects,
                                              .tls = tls});

    fmt::print("{}page    http{}://{}/\ngRPC    {}{}\n", intro, tls ? "s" : "",
               localAddress(options.network.host, web.port()), tls ? "https://" : "",
               localAddress(options.network.host, rpc.port()));
    if (datagrams) fmt::print("UDP     {}\n", localAddress(options.network.host, datagrams->port()));
    if (options.tls.self) printHomeAddresses(options.network, web.port(), tls->fingerprint());
    std::fflush(stdout);
    if (options.identity.pairing) print(pairingCodeLine(*authenticator));
    const Monitored monitored(monitoring, server);
    std::optional<discovery::Announcement> announcement;
    if (options.network.announces)
      announcement.emplace(
          discovery::AnnouncedServer{.pagePort = web.port(),
                                     .grpcPort = rpc.port(),
                                     .encrypted = tls != nullptr,
                                     .fingerprint = options.tls.self ? tls->fingerprint() : "",
                                     .version = kServerName});
    std::optional<agones::Agones> gameServer;
    if (options.agonesPort) gameServer.emplace(server, *options.agonesPort);
    const std::optional<SteadyTime> stopAt = start.finish();
    if (!stopAt) waitForStop(signals, options, tls, authenticator, report);
    guard = std::make_unique<EndGuard>(
        signals, stopAt.value_or(std::chrono::steady_clock::now() + options.server.drain));
    spdlog::info("stopping");
    announcement.reset();
    monitored.stopping();
    if (leave) leave(std::chrono::steady_clock::now() + kLeaveShare * options.server.drain / 4);
    server.stop();
  }
  fmt::print("{}", report());
  return guard;
}

}  // namespace clothstream::program
