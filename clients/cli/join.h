// SPDX-License-Identifier: MIT
// `clothstream join`: follows a stream and says what it was like.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/exit_code.h"
#include "clients/core/core.h"

namespace clothstream::cli {

struct JoinOptions {
  std::string address;  // as completeAddress gives it
  std::string scene;
  std::string name;  // shown to others
  cs_role role = CS_ROLE_UNSPECIFIED;
  std::uint32_t quality = 0, temporalLayers = 0;  // the most that is wanted, as cs_want has it
  bool reconnects = true;
  std::optional<double> seconds;  // nothing: until a signal
  std::string objPath;            // empty: none
  bool json = false;
  bool hash = false;
  bool report = false;                          // a line for each report of the simulation as it comes
  std::vector<std::array<float, 4>> colliders;  // x, y, z, radius, metres
};

// SIGINT and SIGTERM must be blocked in every thread: they end the stream like the end of its time.
ExitCode join(const JoinOptions& options);

}  // namespace clothstream::cli
