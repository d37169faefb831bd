// SPDX-License-Identifier: MIT
// `clothstream set`: changes parameters of a scene that runs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/cli/exit_code.h"
#include "clients/core/core.h"

namespace clothstream::cli {

struct SetOptions {
  std::string address;  // as completeAddress gives it
  std::string scene;
  std::string cloth;                 // empty: every cloth
  cs_cloth_settings settings;        // what is not given is as cs_keep_cloth_settings leaves it
  std::vector<float> gravity, wind;  // three numbers, or none
  std::optional<float> airDensity;
  std::vector<float> gust;  // strength, and seconds; or none
  std::string material;     // empty: as it is

  SetOptions() { cs_keep_cloth_settings(&settings); }
};

bool changesAnything(const SetOptions& options);

// Joins, changes, waits until the server has said that it holds or why not, leaves.
ExitCode set(const SetOptions& options);

}  // namespace clothstream::cli
