// SPDX-License-Identifier: MIT
// Exit codes of the program and their text in --help.
#pragma once

#include <string>

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

struct ExitMeaning {
  ExitCode code;
  const char* text;
};

inline constexpr ExitMeaning kExitMeanings[] = {
    {kOk, "success"},
    {kHashMismatch,
     "--hash or load found a frame that differs from the server's, or encode one that breaks its promise"},
    {kUsage, "wrong arguments"},
    {kUnreachable, "no server answers"},
    {kRefused, "the server refuses (unknown scene, value not allowed)"},
    {kLost, "the stream was lost"},
    {kNotWritten, "a file cannot be written, or writing was interrupted"},
    {kUnreadable, "a file cannot be read or is damaged"},
};

// Text for --help, in lines of at most 107 columns.
std::string exitCodeHelp();

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
