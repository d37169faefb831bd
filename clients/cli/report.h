// SPDX-License-Identifier: MIT
// The figures of a stream: as a live line, as a summary, as JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/core/core.h"

namespace clothstream::cli {

// How the simulation of one cloth does, as the server said last.
struct ClothFigures {
  std::string name, solver;
  cs_cloth_report report{};
};

// A line for people.
std::string text(const ClothFigures& figures);

// The name of a cs_solver, as the scene files have it; of one that this client does not know, its number.
std::string solverName(std::uint32_t solver);

struct Report {
  std::string scene, server, device;
  std::uint32_t vertices = 0, streamRate = 0;
  double seconds = 0;  // from the first frame to the newest
  cs_statistics statistics{};
  std::uint32_t quality = 0, temporalLayers = 0;  // of what is sent now
  std::vector<ClothFigures> cloths;               // none before the first report

  static Report of(const cs_client* client, std::uint64_t nowUs);

  // Over all frames, unlike those of the statistics.
  double framesPerSecond() const;
  double kbitPerSecond() const;

  // One object; with what --hash adds.
  std::string json(bool hash) const;
  // Some lines for people, without the last line's end.
  std::string text(bool hash) const;
};

// One line of a terminal that is written again and again; nothing where it is not shown.
class StatusLine {
 public:
  explicit StatusLine(bool shown) : shown_(shown) {}
  bool shown() const { return shown_; }
  void show(const Report& report) const;
  void clear() const;

 private:
  bool shown_;
};

}  // namespace clothstream::cli
