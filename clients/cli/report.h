// SPDX-License-Identifier: MIT
// The figures of a stream: as a live line, as a summary, as JSON.
#pragma once

#include <cstdint>
#include <string>

#include "clients/core/core.h"

namespace clothstream::cli {

struct Report {
  std::string scene, server, device;
  std::uint32_t vertices = 0, streamRate = 0;
  double seconds = 0;  // from the first frame to the newest
  cs_statistics statistics{};

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
