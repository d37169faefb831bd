// SPDX-License-Identifier: MIT
// Exit codes of the program and their text in --help.
#pragma once

#include <string>

#include "clients/native/failure.h"

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
  kFailed = 8,
};

struct ExitMeaning {
  ExitCode code;
  const char* text;
};

// The table of docs/command-line.md has the same texts.
inline constexpr ExitMeaning kExitMeanings[] = {
    {kOk, "success"},
    {kHashMismatch,
     "--hash or load found a frame that differs from the server's, or encode one that is not as promised"},
    {kUsage, "wrong arguments"},
    {kUnreachable, "no server answers"},
    {kRefused, "the server refuses: an unknown scene, a value that is not allowed"},
    {kLost, "the stream was lost"},
    {kNotWritten, "a file cannot be written, or writing was interrupted"},
    {kUnreadable, "a file cannot be read, or its content is wrong"},
    {kFailed, "clothstream itself failed, for example for a lack of memory"},
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
