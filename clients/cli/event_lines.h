// SPDX-License-Identifier: MIT
// `join --events`: events of a stream as lines of JSON. docs/command-line.md describes them.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "clients/core/core.h"

namespace clothstream::cli {

// Makes lines from the events of one client.
class EventLines {
 public:
  // `frames`: also a line for each frame.
  explicit EventLines(bool frames) : frames_(frames) {}

  // Lines for a call of NativeClient::OnEvents with these arguments, each with a line break. Reports and
  // answers have no line.
  std::string of(cs_client* client, std::uint32_t events);

 private:
  std::string yieldLines(const cs_client* client);

  const bool frames_;
  bool reconnecting_ = false;
  std::uint64_t joinedAs_ = 0;  // id in the last "joined" line
  // Participants and names of the colliders that yield.
  std::set<std::pair<std::uint64_t, std::string>> yielding_;
};

// Makes a line with the event "summary" of an object (Report::json).
std::string summaryLine(const std::string& object);

}  // namespace clothstream::cli
