// SPDX-License-Identifier: MIT
// What `clothstream-server doctor` finds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace clothstream::doctor {

enum class Level : std::uint8_t { good, advice, problem };

struct Finding {
  Level level = Level::good;
  std::string topic;  // device, capacity, crowd, port, certificate, directory, tcp, udp, clock
  std::string text;
  std::string fix = {};                 // what to do; empty if all is well
  nlohmann::ordered_json figures = {};  // null if there are none
};

using Findings = std::vector<Finding>;

// One line for each finding, and one for each fix.
std::string toText(const Findings& findings);
nlohmann::ordered_json toJson(const Findings& findings);
bool hasProblem(const Findings& findings);

}  // namespace clothstream::doctor
