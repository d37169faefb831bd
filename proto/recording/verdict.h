// SPDX-License-Identifier: MIT
// Results of a comparison of recordings, which are exit codes of both programs (docs/command-line.md).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace clothstream::recording {

enum class Verdict : std::uint8_t {
  equal = 0,         // all data exists and has the same bits, or is within the tolerance
  different = 1,     // other bits, although the kernels are not known to be other ones
  otherKernels = 9,  // other bits, and other kernels
  missing = 10,      // no difference, but a part cannot be compared
};

constexpr std::string_view nameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::equal:
      return "equal";
    case Verdict::different:
      return "different";
    case Verdict::otherKernels:
      return "other kernels";
    case Verdict::missing:
      break;
  }
  return "missing";
}

// Whether two runs used the same compiled kernels. Recordings of clients do not name theirs.
enum class Kernels : std::uint8_t { same, other, unknown };

constexpr std::string_view nameOf(Kernels kernels) {
  switch (kernels) {
    case Kernels::same:
      return "same";
    case Kernels::other:
      return "other";
    case Kernels::unknown:
      break;
  }
  return "unknown";
}

// Name of the metadata entry that has the hash of all kernels.
inline constexpr const char* kKernelsEntry = "shaders";

// Compares two values of that entry. "unknown" and "" mean that a recording does not have it.
inline Kernels compareKernels(const std::string& a, const std::string& b) {
  const auto isKnown = [](const std::string& hash) { return !hash.empty() && hash != "unknown"; };
  if (!isKnown(a) || !isKnown(b)) return Kernels::unknown;
  return a == b ? Kernels::same : Kernels::other;
}

// A difference outweighs missing data.
constexpr Verdict verdictOf(bool different, bool missing, Kernels kernels) {
  if (different) return kernels == Kernels::other ? Verdict::otherKernels : Verdict::different;
  return missing ? Verdict::missing : Verdict::equal;
}

// Exit codes of a comparison that has no verdict.
inline constexpr int kWrongArguments = 2, kFileNotWritten = 6, kFileUnreadable = 7, kProgramFailed = 8;

}  // namespace clothstream::recording
