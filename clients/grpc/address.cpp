// SPDX-License-Identifier: MIT
// Splits and checks host and port.
#include "clients/grpc/address.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include <arpa/inet.h>
#include <netinet/in.h>

namespace clothstream {
namespace {

constexpr std::string_view kDefaultPort = "50051", kTls = "https://";

bool isPort(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port != 0;
}

bool isHost(std::string_view text) {
  return !text.empty() && std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) <= ' ' || c == '/' || c == '[' || c == ']';
  });
}

}  // namespace

bool ServerAddress::isEncrypted() const {
  return address.starts_with(kTls);
}

bool ServerAddress::isLoopback() const {
  std::string host = hostAndPort();
  host.resize(host.rfind(':'));
  constexpr std::uint32_t kLoopbackNet = 127;
  in_addr v4{};
  in6_addr v6{};
  if (host.starts_with('[') && ::inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &v6) == 1)
    return IN6_IS_ADDR_LOOPBACK(&v6) != 0;
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
  return host == "localhost";
}

std::string ServerAddress::hostAndPort() const {
  return isEncrypted() ? address.substr(kTls.size()) : address;
}

tl::expected<std::string, std::string> completeAddress(std::string_view text) {
  const bool encrypted = text.starts_with(kTls);
  if (encrypted) text.remove_prefix(kTls.size());
  if (encrypted && text.ends_with('/')) text.remove_suffix(1);
  std::string_view host = text, port = kDefaultPort;
  const std::size_t colon = text.rfind(':');
  bool v6 = false;
  if (text.starts_with('[')) {
    const std::size_t close = text.find(']');
    if (close == std::string_view::npos)
      return tl::unexpected("the address \"" + std::string(text) + "\" has no closing ]");
    v6 = true;
    host = text.substr(1, close - 1);
    const std::string_view rest = text.substr(close + 1);
    if (!rest.empty()) port = rest.starts_with(':') ? rest.substr(1) : std::string_view();
  } else if (colon != std::string_view::npos && text.find(':') != colon) {
    v6 = true;
  } else if (colon != std::string_view::npos) {
    host = text.substr(0, colon);
    port = text.substr(colon + 1);
  }
  if (!isHost(host))
    return tl::unexpected("the address \"" + std::string(text) + "\" has no host; use HOST or HOST:PORT");
  if (!isPort(port))
    return tl::unexpected("the address \"" + std::string(text) +
                          "\" has no valid port after the host; use 1 to 65535");
  std::string address;
  address.append(encrypted ? kTls : "")
      .append(v6 ? "[" : "")
      .append(host)
      .append(v6 ? "]:" : ":")
      .append(port);
  return address;
}

}  // namespace clothstream
