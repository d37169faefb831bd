// SPDX-License-Identifier: MIT
// `clothstream join`: follows a stream and prints a summary.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/exit_code.h"
#include "clients/core/core.h"
#include "clients/datagram/datagram_transport.h"
#include "clients/native/address.h"

namespace clothstream::cli {

struct JoinOptions {
  ServerAddress address = std::string(kDefaultAddress);
  std::string scene;
  std::string name;  // name that others see
  cs_role role = CS_ROLE_UNSPECIFIED;
  std::uint32_t quality = 0;      // finest wanted, as in cs_want
  std::uint32_t maxVertices = 0;  // 0: the default of cs_limits
  Datagrams datagrams = Datagrams::automatic;
  bool reconnects = true;
  std::optional<double> seconds;  // not set: until a signal
  std::string objPath;            // empty: no file
  bool json = false;
  bool hash = false;
  bool report = false;    // print each report of the simulation
  bool events = false;    // print events as lines of JSON (event_lines.h)
  bool frames = false;    // with events: a line for each frame too
  std::string inputPath;  // lines of input (input_lines.h); empty: none
  std::vector<cs_own_collider> colliders;
};

// SIGINT and SIGTERM must be blocked in every thread; they end the stream like its time limit.
ExitCode join(const JoinOptions& options);

}  // namespace clothstream::cli
