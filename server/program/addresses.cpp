// SPDX-License-Identifier: MIT
#include "server/program/addresses.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include "server/tls/certificate.h"

namespace clothstream::program {

std::string localAddress(const std::string& host, std::uint16_t port) {
  if (host == "0.0.0.0") return fmt::format("127.0.0.1:{}", port);
  if (host == "::") return fmt::format("[::1]:{}", port);
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

bool isAddress(const std::string& text) {
  in_addr v4{};
  in6_addr v6{};
  return ::inet_pton(AF_INET, text.c_str(), &v4) == 1 || ::inet_pton(AF_INET6, text.c_str(), &v6) == 1;
}

std::vector<std::string> addressesOf(const std::string& host) {
  if (host == "localhost") return {"127.0.0.1"};
  if (isAddress(host) && host != "0.0.0.0" && host != "::") return {host};
  const auto listens = [&](const std::string& address) {
    return host != "0.0.0.0" || address.find(':') == std::string::npos;
  };
  std::vector<std::string> addresses;
  for (const std::string& name : tls::namesOfThisMachine())
    if (isAddress(name) && !isLoopback(name) && listens(name)) addresses.push_back(name);
  return addresses;
}

endpoint::DatagramEndpointOptions datagramOptions(const NetworkOptions& network) {
  return {.host = network.host,
          .port = network.datagramPort.value_or(network.port),
          .ownAddresses = addressesOf(network.host),
          .publicAddresses = network.publicAddresses,
          .maxPeers = 2 * network.maxConnections};
}

std::string addressInNetwork(const NetworkOptions& network) {
  if (isLoopback(network.host)) return {};
  if (network.host != "0.0.0.0" && network.host != "::") return network.host;
  for (const std::string& name : tls::namesOfThisMachine())
    if (name.find('.') != std::string::npos && name.find_first_not_of("0123456789.") == std::string::npos &&
        !name.starts_with("127."))
      return name;
  return {};
}

}  // namespace clothstream::program
