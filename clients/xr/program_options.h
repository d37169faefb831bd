// SPDX-License-Identifier: MIT
// Command line of clothstream-xr.
#pragma once

#include <optional>
#include <string>

#include "clients/xr/connection/connection.h"
#include "clients/xr/flat/flat.h"
#include "clients/xr/openxr/headset.h"

namespace clothstream::xr {

struct ProgramOptions {
  ConnectionOptions connection;
  HeadsetOptions headset;
  FlatOptions flat;
  bool isFlat = false;
  double waitForRuntime = -1;  // s; negative: without limit
  std::string font;
  bool isVerbose = false;
};

// Reads the command line. Returns none, and sets `exitCode`, if the program ends at once: after --help, or
// with a message on standard error about an option that is not allowed.
std::optional<ProgramOptions> readOptions(int count, char** arguments, int& exitCode);

}  // namespace clothstream::xr
