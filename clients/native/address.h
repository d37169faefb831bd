// SPDX-License-Identifier: MIT
// Addresses of servers, as users write them.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

namespace clothstream {

inline constexpr std::string_view kDefaultAddress = "127.0.0.1:50051";

// Endpoint of a server that a client connects to. It decides the default port, and the schemes.
enum class Endpoint {
  grpc,  // 50051; https:// means TLS
  web,   // 8080; ws:// and http:// mean no TLS, wss:// and https:// mean TLS
};

// Accepts "host", "host:port", "[v6]", "[v6]:port" or a bare v6 address, each also after a scheme of the
// endpoint and with a slash at its end. Returns HOST:PORT, or https://HOST:PORT with TLS. The error names the
// mistake and the allowed form.
[[nodiscard]] tl::expected<std::string, std::string> completeAddress(std::string_view text,
                                                                     Endpoint endpoint = Endpoint::grpc);

// Where a server is, and how to recognise it.
struct ServerAddress {
  // From completeAddress(). Most servers need no more.
  ServerAddress(std::string complete)
      : address(std::move(complete)) {}                       // NOLINT(google-explicit-constructor)
  ServerAddress(const char* complete) : address(complete) {}  // NOLINT(google-explicit-constructor)

  bool isEncrypted() const;
  // Whether the server runs on this machine: localhost, or a loopback address.
  bool isLoopback() const;
  // HOST:PORT; a v6 address has brackets.
  std::string hostAndPort() const;
  // Without brackets.
  std::string host() const;
  std::string port() const;
  // The same with this host, which is a DNS name or empty. Empty: unchanged.
  ServerAddress at(std::string_view name) const;

  std::string address;
  // With TLS, the server must have a certificate of an authority in this PEM file; empty means the
  // authorities of the system. With a fingerprint (fingerprintOf), the server must have this key instead,
  // whatever its name.
  std::string caFile{}, fingerprint{};
  // Token that proves who the client is; empty: none. Do not print it.
  std::string token{};
};

}  // namespace clothstream
