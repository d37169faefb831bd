// SPDX-License-Identifier: MIT
// Exit codes of the program and their text in --help.
#pragma once

#include "clients/grpc/failure.h"

namespace clothstream::cli {

enum ExitCode : int {
  kOk = 0,
  kHashMismatch = 1,
  kUsage = 2,
  kUnreachable = 3,
  kRefused = 4,
  kLost = 5,
  kNotWritten = 6,
  kUnreadable = 7,
};

inline constexpr const char* kExitCodes =
    "Exit codes: 0 success; 1 --hash found a frame that differs from the server's, or encode one that breaks "
    "its\n"
    "promise; 2 wrong arguments; 3 no server answers; 4 the server refuses (unknown scene, value not "
    "allowed);\n"
    "5 the stream was lost; 6 a file cannot be written, or writing was interrupted; 7 a file cannot be read "
    "or is\n"
    "damaged.";

constexpr ExitCode exitCodeOf(Failure::Kind kind) {
  switch (kind) {
    case Failure::Kind::unreachable:
      return kUnreachable;
    case Failure::Kind::refused:
      return kRefused;
    case Failure::Kind::lost:
      return kLost;
  }
  return kLost;
}

}  // namespace clothstream::cli
