// SPDX-License-Identifier: MIT
// Writes the recorded sessions and the observations of the native client as JSON, for the test of the
// WebAssembly build.
#include <fstream>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tests/core/sessions.h"

namespace {

using namespace clothstream::client;

std::string hex(const std::string& bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

nlohmann::json json(const Observation& seen) {
  const auto hash = [](std::uint64_t value) { return fmt::format("{:016x}", value); };
  return {{"events", seen.events},
          {"state", static_cast<int>(seen.state)},
          {"tick", fmt::format("{}", seen.tick)},
          {"decodeErrors", seen.decodeErrors},
          {"hashMismatches", seen.hashMismatches},
          {"reconstructionHash", hash(seen.reconstructionHash)},
          {"positionsHash", hash(seen.positionsHash)},
          {"normalsHash", hash(seen.normalsHash)},
          {"playedPositionsHash", hash(seen.playedPositionsHash)},
          {"playedNormalsHash", hash(seen.playedNormalsHash)},
          {"playedCollidersHash", hash(seen.playedCollidersHash)},
          {"triangleCount", seen.triangleCount},
          {"outgoingHash", hash(seen.outgoingHash)},
          // Hexadecimal, because corrupted text may not be UTF-8.
          {"errorText", hex(seen.errorText)}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: record_sessions FILE\n";
    return 2;
  }
  nlohmann::json sessions = nlohmann::json::array();
  for (const Session& session : recordedSessions()) {
    nlohmann::json messages = nlohmann::json::array(), expected = nlohmann::json::array();
    for (const std::string& message : session.messages) messages.push_back(hex(message));
    for (const Observation& seen : replay(session)) expected.push_back(json(seen));
    sessions.push_back({{"name", session.name}, {"messages", messages}, {"expected", expected}});
  }
  std::ofstream file(argv[1]);
  file << nlohmann::json{{"stepUs", kStepUs}, {"playOutDelayMs", kPlayOutDelayMs}, {"sessions", sessions}};
  file.flush();
  return file ? 0 : 1;
}
