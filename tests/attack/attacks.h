// SPDX-License-Identifier: MIT
// Attacks on a running server.
#pragma once

#include <chrono>
#include <span>
#include <string>

namespace clothstream::attack {

struct Target {
  std::string grpc, web;  // HOST:PORT of both endpoints
  std::chrono::seconds time;
};

struct Attack {
  const char* name;
  const char* description;
  // Attacks for about Target::time. Returns what the server answered.
  std::string (*perform)(const Target& target);
  // Further arguments of the server.
  const char* serverArguments = "";
};

std::span<const Attack> attacks();

}  // namespace clothstream::attack
