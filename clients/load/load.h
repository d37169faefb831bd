// SPDX-License-Identifier: MIT
// Many participants of one scene at once, and what they get.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clients/load/link.h"
#include "clients/load/participant.h"

namespace clothstream::load {

struct LoadOptions {
  std::string scene;  // empty: the server's default
  std::uint32_t participants = 10;
  std::uint32_t decoders = 0;  // of these; the others acknowledge frames unread
  std::uint32_t viewers = 0;   // of these, the last ones: they send no poses
  std::uint32_t slow = 0;      // beside these
  double slowBytesPerSecond = 20'000;
  std::uint32_t intruders = 0;  // beside these
  double joinsPerSecond = 100;  // until all are there
  double leavesPerSecond = 0;   // then; another comes for each
  double seconds = 10;          // once all are there
};

struct LoadReport {
  double seconds = 0;
  std::uint32_t participants = 0, slow = 0, intruders = 0;
  // Of those that are not slow.
  Figures figures;
  Figures slowFigures;
  std::uint64_t joined = 0, left = 0, visits = 0;
  // Those who were refused or lost their connection, and what the first was told.
  std::uint64_t lost = 0;
  Failure firstLoss;

  // Of all that took part at a time, a second and participant.
  double framesPerSecond() const;
  double slowFramesPerSecond() const;
  double mbitPerSecond() const;
};

// 0 of none.
double mean(const std::vector<float>& samples);
// Nearest rank; 0 of none. `samples` is put in order.
double percentile(std::vector<float>& samples, double percent);

struct LoadProgress {
  std::function<bool()> running;                // asked 71 times a second; false ends the load early
  std::function<void()> gathered;               // all are there
  std::function<void()> measured;               // and still are: the time is over
  std::function<void(const LoadReport&)> show;  // once a second, of the last one; may be empty
};
LoadReport runLoad(Links& links, const LoadOptions& options, const LoadProgress& progress);

}  // namespace clothstream::load
