// SPDX-License-Identifier: MIT
// What the program ends with; --help says the same.
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
};

inline constexpr const char* kExitCodes =
    "Ends with 0 if all went well, 1 if --hash found a frame that is not the server's, 2 for wrong "
    "arguments, 3 if no\n"
    "server answers, 4 if the server refuses (an unknown scene, a value that is not allowed), 5 if the "
    "stream is lost, 6 if "
    "the --obj\n"
    "file cannot be written.";

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
