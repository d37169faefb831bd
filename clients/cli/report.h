// SPDX-License-Identifier: MIT
// Figures of a stream: live line, summary and JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "clients/core/core.h"

namespace clothstream::cli {

// Newest simulation report of one cloth.
struct ClothFigures {
  std::string name, solver;
  cs_cloth_report report{};
};

// One line of text for users.
std::string text(const ClothFigures& figures);

// Name of a cs_solver as in scene files; the number of an unknown solver.
std::string solverName(std::uint32_t solver);

// Share of the packets of frames that were lost, 0 to 1.
double lossOf(const cs_datagram_statistics& datagrams);
// One line of text for users, and a JSON object.
std::string text(const cs_datagram_statistics& datagrams);
nlohmann::ordered_json jsonOf(const cs_datagram_statistics& datagrams);

struct Report {
  std::string scene, server, device;
  std::uint32_t vertices = 0, streamRate = 0, frameDivisor = 1;
  double seconds = 0;  // from the first frame to the newest
  cs_statistics statistics{};
  std::uint32_t quality = 0;                        // as currently sent
  std::optional<cs_datagram_statistics> datagrams;  // if any were open
  std::vector<ClothFigures> cloths;                 // empty before the first report

  static Report of(const cs_client* client, std::uint64_t nowUs);

  // Whether frames arrive in datagrams now.
  bool usesDatagrams() const { return datagrams && datagrams->in_use != 0; }
  // Averages over all frames. The statistics hold averages over the last second.
  double framesPerSecond() const;
  double kbitPerSecond() const;

  // One JSON object. `hash` adds the result of --hash.
  std::string json(bool hash) const;
  // Several lines of text, without a final line break.
  std::string text(bool hash) const;
};

// A line on the terminal that is updated in place. Does nothing if not shown.
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
