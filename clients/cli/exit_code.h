// SPDX-License-Identifier: MIT
// Exit codes of the program and their text in --help.
#pragma once

#include <string>

#include "clients/native/failure.h"
#include "proto/recording/verdict.h"

namespace clothstream::cli {

enum ExitCode : int {
  kOk = 0,
  kHashMismatch = static_cast<int>(recording::Verdict::different),
  kUsage = recording::kWrongArguments,
  kUnreachable = 3,
  kRefused = 4,
  kLost = 5,
  kNotWritten = recording::kFileNotWritten,
  kUnreadable = recording::kFileUnreadable,
  kFailed = recording::kProgramFailed,
  kOtherKernels = static_cast<int>(recording::Verdict::otherKernels),
  kMissing = static_cast<int>(recording::Verdict::missing),
};

struct ExitMeaning {
  ExitCode code;
  const char* text;
};

// The table of docs/command-line.md has the same texts.
inline constexpr ExitMeaning kExitMeanings[] = {
    {kOk, "success"},
    {kHashMismatch,
     "a difference: --hash or load found a frame that differs from the server's, encode one that is not as "
     "promised, or a comparison other bits"},
    {kUsage, "wrong arguments"},
    {kUnreachable, "no server answers"},
    {kRefused, "the server refuses: an unknown scene, a value that is not allowed"},
    {kLost, "the stream was lost"},
    {kNotWritten, "a file cannot be written, or writing was interrupted"},
    {kUnreadable, "a file cannot be read, or its content is wrong"},
    {kFailed, "clothstream itself failed, for example for a lack of memory"},
    {kOtherKernels, "a comparison found other bits, which other kernels made"},
    {kMissing, "a comparison found no difference, but data that is missing or damaged"},
};

// Text for --help, in lines of at most 107 columns.
std::string exitCodeHelp();

// Verdicts of comparisons have the codes kOk, kHashMismatch, kOtherKernels and kMissing.
constexpr ExitCode exitCodeOf(recording::Verdict verdict) {
  return static_cast<ExitCode>(verdict);
}

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
