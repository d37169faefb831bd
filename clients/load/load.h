// SPDX-License-Identifier: MIT
// Load test: many participants in one scene or in many, and what they receive.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/datagram/datagram_transport.h"
#include "clients/load/link.h"
#include "clients/load/participant.h"

namespace clothstream::load {

struct LoadOptions {
  std::string scene;         // empty: the server's default
  std::uint32_t scenes = 0;  // scenes to create, for the participants in turn; 0: all join `scene`
  std::uint32_t nodes = 1024, rate = 72;  // of each created scene, as in hungScene()
  std::string token;                      // of all participants and hostile clients; empty: none
  std::uint32_t participants = 10;
  std::uint32_t decoders = 0;  // participants that decode; the others only acknowledge frames
  std::uint32_t viewers = 0;   // participants that send no poses; the last ones to join
  std::uint32_t slow = 0;      // slow readers in addition to the participants
  double slowBytesPerSecond = 20'000;
  std::uint32_t hostileClients = 0;            // in addition to the others
  double joinsPerSecond = 100;                 // until all have joined
  double leavesPerSecond = 0;                  // after all have joined; each is replaced
  double seconds = 10;                         // after all have joined
  std::uint32_t maxVertices = 0;               // as in limitVertices
  bool keepsFrames = false;                    // as in ParticipantOptions, for participants that are not slow
  Datagrams datagrams = Datagrams::automatic;  // of participants that are not slow
  bool sctp = false;                           // as in DatagramHost
};

// The fate of the scenes that the test has created.
struct SceneReport {
  std::uint32_t wanted = 0, created = 0;
  std::optional<Failure> failure;  // why the next one could not be created
  std::uint32_t remaining = 0;     // scenes that could not be deleted
  Failure whyRemaining;            // of the first of them
  // Time for each scene from the request to its answer, and then from the connection of the first participant
  // to its first frame, ms. The time between the two is that of the test and does not count.
  std::vector<float> firstFrameMs;
};

struct LoadReport {
  double seconds = 0;
  Clock::time_point start;  // of the measurement
  std::uint32_t participants = 0, slow = 0, hostileClients = 0;
  // Figures of the participants that are not slow.
  Figures figures;
  Figures slowFigures;
  std::uint64_t joined = 0, left = 0, visits = 0;
  // Number of participants that were refused or disconnected, and the reason of the first.
  std::uint64_t lost = 0;
  Failure firstLoss;
  SceneReport scenes;
  std::vector<float> participantRates;  // frames/s of each participant that is not slow
  // Time of each participant that is not slow from connecting to its first frame, and to the first one that
  // came in datagrams, ms.
  std::vector<float> joinToFrameMs, joinToDatagramFrameMs;
  // Number of participants with datagrams at the end, and the sum of their figures.
  std::uint32_t withDatagrams = 0;
  cs_datagram_statistics datagrams{};

  // Average rates over the measured time: frames per participant, and Mbit of all clients.
  double framesPerSecond() const;
  double slowFramesPerSecond() const;
  double mbitPerSecond() const;
};

// Returns 0 without samples.
double mean(const std::vector<float>& samples);
// Nearest-rank percentile; 0 without samples. Reorders `samples`.
double percentile(std::vector<float>& samples, double percent);

struct LoadProgress {
  std::function<bool()> running;                // called 71 times a second; false ends the test
  std::function<void()> gathered;               // called when all have joined
  std::function<void()> measured;               // called at the end of the measurement
  std::function<void(const LoadReport&)> show;  // figures of the last second; may be empty
};
LoadReport runLoad(Links& links, const LoadOptions& options, const LoadProgress& progress);

}  // namespace clothstream::load
