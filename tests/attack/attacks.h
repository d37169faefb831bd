// SPDX-License-Identifier: MIT
// Attacks on a running server.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

namespace clothstream::attack {

struct Target {
  std::string grpc, web;  // HOST:PORT of both endpoints
  std::chrono::seconds time;
};

// Identity that the server requires of its clients.
enum class Access : std::uint8_t {
  open,
  tokens,   // signed by the key `attack`, which only the honest client has
  pairing,  // the honest client has paired
};

struct Attack {
  const char* name;
  const char* description;
  // Attacks for about Target::time. Returns what the server answered.
  std::string (*perform)(const Target& target);
  // Further arguments of the server, separated by spaces. DIRECTORY is replaced by an empty directory.
  const char* serverArguments = "";
  Access access = Access::open;
};

std::span<const Attack> attacks();

}  // namespace clothstream::attack
