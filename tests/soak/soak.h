// SPDX-License-Identifier: MIT
// A server under mixed use and all faults for a long time: what honest viewers receive, and what leaks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace clothstream::soak {

struct SoakOptions {
  std::string server;                // program
  std::filesystem::path layers;      // directory of the Vulkan layer that loses devices; empty: none is lost
  std::filesystem::path csv;         // a row a second; empty: none
  double seconds = 600;              // of use, after all scenes were loaded once
  std::uint32_t participants = 64;   // over eight scenes, slow readers and vanishing ones included
  std::uint32_t hostileClients = 4;  // in addition
  double lossSeconds = 150;          // time between two losses of the device
};

// The server once per second.
struct Sample {
  double seconds = 0;  // since the start of use
  double megabytes = 0;
  std::uint64_t descriptors = 0, threads = 0;
  std::uint64_t scenes = 0, participants = 0;
  double expected = 0, received = 0;  // frames of honest viewers in this second
  bool afterLoss = false;             // within kLossWindow after a loss of the device
};

struct SoakReport {
  // Time after a loss of the device in which its scenes are loaded again, s.
  static constexpr double kLossWindow = 10;
  // Samples without which memory and growth say nothing.
  static constexpr std::size_t kLeastSamples = 60;

  std::vector<Sample> samples;
  Sample before, after;  // without participants
  std::uint64_t visits = 0, hostileVisits = 0, createdScenes = 0, recordings = 0, losses = 0;
  // Honest viewers that the server cut off, and the reason of the first.
  std::uint64_t cutOff = 0;
  std::string firstReason;
  // CreateScene calls that the server refused, and the reason of the first.
  std::uint64_t refusedScenes = 0;
  std::string firstRefusal;
  bool crashed = false;
  double endSeconds = 0;  // from SIGTERM to the end

  // Part of the frames that honest viewers received; without seconds after losses if `healthy`.
  double share(bool healthy) const;
  // Change of the mean resident memory from the first to the last fifth of the time after warm-up, which is
  // the first quarter. 0 with fewer than kLeastSamples.
  double drift() const;
  // Change of the mean of a count, such as that of descriptors, from the middle fifth of the time to the
  // last. Shows leaks that are too slow for leaks(). 0 with fewer than kLeastSamples.
  double growth(std::uint64_t Sample::*count) const;
  bool leaks() const;
};

// Throws std::runtime_error if the server does not start or its scenes cannot be joined.
SoakReport runSoak(const SoakOptions& options);

std::string toText(const SoakReport& report);

}  // namespace clothstream::soak
