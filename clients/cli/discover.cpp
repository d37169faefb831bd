// SPDX-License-Identifier: MIT
#include "clients/cli/discover.h"

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <avahi-client/client.h>
#include <avahi-client/lookup.h>
#include <avahi-common/error.h>
#include <avahi-common/malloc.h>
#include <avahi-common/simple-watch.h>
#include <avahi-common/strlst.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "proto/discovery/service.h"
#include "proto/text/printable.h"
#include "proto/tls/fingerprint.h"

namespace clothstream::cli {
namespace {

using Clock = std::chrono::steady_clock;

// Announcements of one search that are resolved; further ones are left out.
constexpr std::size_t kMaxAnnouncements = 256;

// As announced: any program in the network can announce anything.
struct Server {
  std::string version, fingerprint, host;
  std::uint16_t pagePort = 0, grpcPort = 0;
  bool encrypted = false;
  bool byAddress = false;  // host is an IPv4 address

  std::string page() const { return url("http", pagePort) + "/"; }
  // For `clothstream join` and the other commands.
  std::string grpc() const {
    return encrypted ? url("http", grpcPort) : fmt::format("{}:{}", host, grpcPort);
  }

 private:
  std::string url(const char* scheme, std::uint16_t port) const {
    return fmt::format("{}{}://{}:{}", scheme, encrypted ? "s" : "", host, port);
  }
};

std::string textOf(AvahiStringList* record, const char* key) {
  AvahiStringList* const entry = avahi_string_list_find(record, key);
  char* value = nullptr;
  if (entry == nullptr || avahi_string_list_get_pair(entry, nullptr, &value, nullptr) < 0 || value == nullptr)
    return {};
  std::string text = printable(value);
  avahi_free(value);
  return text;
}

std::uint16_t portIn(const std::string& text) {
  unsigned port = 0;
  for (const char digit : text) {
    if (digit < '0' || digit > '9') return 0;
    port = port * 10 + static_cast<unsigned>(digit - '0');
    if (port > 0xffff) return 0;
  }
  return static_cast<std::uint16_t>(port);
}

// One search in the network.
class Search {
 public:
  // Returns an error, or empty.
  std::string run(Clock::duration limit) {
    const std::unique_ptr<AvahiSimplePoll, decltype(&avahi_simple_poll_free)> poll(avahi_simple_poll_new(),
                                                                                   avahi_simple_poll_free);
    int error = 0;
    const std::unique_ptr<AvahiClient, decltype(&avahi_client_free)> client(
        avahi_client_new(avahi_simple_poll_get(poll.get()), AvahiClientFlags{}, onClient, this, &error),
        avahi_client_free);
    if (!client) return problem(error);
    // Freed with the client.
    const AvahiServiceBrowser* const browser =
        avahi_service_browser_new(client.get(), AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, discovery::kServiceType,
                                  nullptr, AvahiLookupFlags{}, onAnnouncement, this);
    if (browser == nullptr) return problem(avahi_client_errno(client.get()));
    const auto end = Clock::now() + limit;
    while (failure_ == 0 && !(browsed_ && unresolved_ == 0)) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
      if (left.count() <= 0) break;
      if (avahi_simple_poll_iterate(poll.get(), static_cast<int>(left.count())) != 0) break;
    }
    return failure_ == 0 ? std::string() : problem(failure_);
  }

  // By name.
  const std::map<std::string, Server>& servers() const { return servers_; }

 private:
  static std::string problem(int error) {
    return fmt::format(
        "the Avahi daemon does not answer ({}): install and start avahi-daemon, or use the server's address",
        avahi_strerror(error));
  }

  static void onClient(AvahiClient* client, AvahiClientState state, void* self) {
    if (state == AVAHI_CLIENT_FAILURE) static_cast<Search*>(self)->failure_ = avahi_client_errno(client);
  }

  static void onAnnouncement(AvahiServiceBrowser* browser, AvahiIfIndex interface, AvahiProtocol protocol,
                             AvahiBrowserEvent event, const char* name, const char* type, const char* domain,
                             AvahiLookupResultFlags, void* self) {
    Search& search = *static_cast<Search*>(self);
    AvahiClient* const client = avahi_service_browser_get_client(browser);
    if (event == AVAHI_BROWSER_FAILURE) search.failure_ = avahi_client_errno(client);
    if (event == AVAHI_BROWSER_ALL_FOR_NOW) search.browsed_ = true;
    if (event != AVAHI_BROWSER_NEW || search.announcements_ == kMaxAnnouncements) return;
    ++search.announcements_;
    // Avahi may answer with an IPv6 address unless it is asked for an IPv4 one.
    for (const AvahiProtocol wanted : {AVAHI_PROTO_INET, AVAHI_PROTO_UNSPEC})
      if (avahi_service_resolver_new(client, interface, protocol, name, type, domain, wanted,
                                     AvahiLookupFlags{}, onResolved, self) != nullptr)
        ++search.unresolved_;
  }

  static void onResolved(AvahiServiceResolver* resolver, AvahiIfIndex, AvahiProtocol,
                         AvahiResolverEvent event, const char* name, const char*, const char*,
                         const char* host, const AvahiAddress* address, std::uint16_t port,
                         AvahiStringList* text, AvahiLookupResultFlags, void* self) {
    Search& search = *static_cast<Search*>(self);
    --search.unresolved_;
    if (event == AVAHI_RESOLVER_FOUND) search.add(name, host, *address, port, text);
    avahi_service_resolver_free(resolver);
  }

  // A server is found several times: for each interface and protocol. Its IPv4 address is preferred;
  // otherwise its name is used, because a local IPv6 address is only valid together with an interface.
  void add(const char* name, const char* host, const AvahiAddress& address, std::uint16_t port,
           AvahiStringList* text) {
    Server& server = servers_[printable(name)];
    if (server.byAddress) return;
    server.byAddress = address.proto == AVAHI_PROTO_INET;
    char shown[AVAHI_ADDRESS_STR_MAX];
    server.host = server.byAddress ? avahi_address_snprint(shown, sizeof shown, &address) : printable(host);
    server.pagePort = port;
    server.grpcPort = portIn(textOf(text, discovery::kGrpcPortKey));
    server.encrypted = textOf(text, discovery::kTlsKey) == "1";
    server.version = textOf(text, discovery::kVersionKey);
    server.fingerprint = normalFingerprint(textOf(text, discovery::kFingerprintKey)).value_or("");
  }

  std::map<std::string, Server> servers_;
  std::size_t announcements_ = 0, unresolved_ = 0;
  bool browsed_ = false;
  int failure_ = 0;
};

void printText(const std::map<std::string, Server>& servers) {
  for (const auto& [name, server] : servers) {
    print("{} ({})\n  page  {}\n  join  clothstream join {}\n", name, server.version, server.page(),
          server.grpc());
    if (!server.fingerprint.empty()) print("  key   {}\n", server.fingerprint);
  }
  if (servers.empty())
    print("No server is announced in this network. A server announces itself with --announce on.\n");
}

std::string json(const std::map<std::string, Server>& servers) {
  auto array = nlohmann::ordered_json::array();
  for (const auto& [name, server] : servers)
    array.push_back({{"name", name},
                     {"version", server.version},
                     {"page", server.page()},
                     {"address", server.grpc()},
                     {"fingerprint", server.fingerprint}});
  return jsonText(array, 2);
}

}  // namespace

void DiscoverCommand::add(CLI::App& app) {
  command_ = app.add_subcommand("discover",
                                "List the servers that are announced in this network by mDNS. Anyone in the "
                                "network can announce a server: compare its key with what the server prints");
  command_->add_option("--seconds", seconds_, "Longest time to search")
      ->check(CLI::Range(0.1, 60.0))
      ->capture_default_str();
  command_->add_flag("--json", json_, "Print a JSON array");
}

ExitCode DiscoverCommand::run() const {
  Search search;
  const auto limit = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_));
  if (const std::string problem = search.run(limit); !problem.empty())
    return printError(kUnreachable, problem);
  if (json_)
    put(json(search.servers()) + '\n');
  else
    printText(search.servers());
  return kOk;
}

}  // namespace clothstream::cli
