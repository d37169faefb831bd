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
  std::string token = {};  // of an honest participant of another tenant than the victim's; empty: none
  // HOST:PORT of the endpoint for operators; empty without --metrics-port.
  std::string metrics = {};
  std::string directory = {};  // of Attack::serverArguments
  int process = 0;             // id of the server's process
};

// Scene of the honest client.
inline constexpr const char* kVictimScene = "curtain";

// Identity that the server requires of its clients.
enum class Access : std::uint8_t {
  open,
  tokens,   // signed by the key `attack`; Target::token is one
  pairing,  // the honest client has paired
};

struct Attack {
  const char* name;
  const char* description;
  // Attacks for about Target::time. Returns what the server answered.
  std::string (*perform)(const Target& target);
  // Regular expression that the whole answer must match. Otherwise the server has accepted or refused what it
  // should not.
  const char* expected;
  // Further arguments of the server, separated by spaces. DIRECTORY is replaced by an empty directory.
  const char* serverArguments = "";
  Access access = Access::open;
  // The server gets SIGTERM while the attack still runs.
  bool endsDuring = false;
  // The honest client watches over datagrams, which it requires to join.
  bool datagrams = false;
};

std::span<const Attack> attacks();

}  // namespace clothstream::attack
