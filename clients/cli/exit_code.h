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
  kUnreadable = 7,
};

inline constexpr const char* kExitCodes =
    "Ends with 0 if all went well, 1 if --hash found a frame that is not the server's or encode one that is "
    "not as "
    "promised,\n"
    "2 for wrong arguments, 3 if no server answers, 4 if the server refuses (an unknown scene, a value that "
    "is not "
    "allowed),\n"
    "5 if the stream is lost, 6 if a file cannot be written or writing it was interrupted, 7 if a file "
    "cannot be read "
    "or is\n"
    "not what it should be.";

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
