// SPDX-License-Identifier: MIT
// Splits and checks host and port.
#include "clients/native/address.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace clothstream {
namespace {

constexpr std::string_view kTls = "https://";

template <typename Number>
bool isNumber(std::string_view text) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

bool isPort(std::string_view text) {
  return isNumber<std::uint16_t>(text) && text.find_first_not_of('0') != std::string_view::npos;
}

bool isHost(std::string_view text) {
  return !text.empty() && std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) <= ' ' || c == '/' || c == '[' || c == ']';
  });
}

// Whether the text is 127.x.y.z.
bool isLoopbackV4(std::string_view text) {
  constexpr int kParts = 4;
  if (!text.starts_with("127.") || std::count(text.begin(), text.end(), '.') != kParts - 1) return false;
  while (!text.empty()) {
    const std::size_t dot = std::min(text.find('.'), text.size());
    if (!isNumber<std::uint8_t>(text.substr(0, dot))) return false;
    text.remove_prefix(std::min(dot + 1, text.size()));
  }
  return true;
}

// Removes the scheme of the endpoint, if there is one. Returns whether it means TLS.
bool takeScheme(std::string_view& text, Endpoint endpoint) {
  struct Scheme {
    std::string_view text;
    bool encrypted, alsoGrpc;
  };
  constexpr Scheme kSchemes[] = {
      {kTls, true, true}, {"wss://", true, false}, {"http://", false, false}, {"ws://", false, false}};
  for (const Scheme& scheme : kSchemes) {
    if (!text.starts_with(scheme.text) || (endpoint == Endpoint::grpc && !scheme.alsoGrpc)) continue;
    text.remove_prefix(scheme.text.size());
    if (text.ends_with('/')) text.remove_suffix(1);
    return scheme.encrypted;
  }
  return false;
}

}  // namespace

bool ServerAddress::isEncrypted() const {
  return address.starts_with(kTls);
}

bool ServerAddress::isLoopback() const {
  const std::string name = host();
  return name == "localhost" || name == "::1" || isLoopbackV4(name);
}

std::string ServerAddress::hostAndPort() const {
  return isEncrypted() ? address.substr(kTls.size()) : address;
}

std::string ServerAddress::host() const {
  const std::string text = hostAndPort();
  const std::string name = text.substr(0, text.rfind(':'));
  return name.starts_with('[') ? name.substr(1, name.size() - 2) : name;
}

std::string ServerAddress::port() const {
  const std::string text = hostAndPort();
  return text.substr(text.rfind(':') + 1);
}

ServerAddress ServerAddress::at(std::string_view name) const {
  ServerAddress other = *this;
  if (name.empty()) return other;
  other.address = isEncrypted() ? kTls : "";
  other.address.append(name).append(":").append(port());
  return other;
}

tl::expected<std::string, std::string> completeAddress(std::string_view text, Endpoint endpoint) {
  const bool encrypted = takeScheme(text, endpoint);
  std::string_view host = text, port = endpoint == Endpoint::grpc ? "50051" : "8080";
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
