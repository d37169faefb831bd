// SPDX-License-Identifier: MIT
// What went wrong, and what the program ends with for that.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <tl/expected.hpp>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct Complaint {
  ExitCode code = kOk;
  std::string text;
};

template <typename... Arguments>
tl::unexpected<Complaint> complaint(ExitCode code, fmt::format_string<Arguments...> text,
                                    Arguments&&... arguments) {
  return tl::unexpected(Complaint{code, fmt::format(text, std::forward<Arguments>(arguments)...)});
}

// The result, its error being a complaint with this code.
template <typename T>
tl::expected<T, Complaint> orComplaint(ExitCode code, tl::expected<T, std::string> result) {
  return std::move(result).map_error([&](std::string text) { return Complaint{code, std::move(text)}; });
}

// What is read frame by frame is not to be what is written.
inline tl::expected<void, Complaint> areDifferent(const std::string& in, const std::string& out) {
  std::error_code missing;
  if (std::filesystem::equivalent(in, out, missing))
    return complaint(kUsage, "{} is {}: the result needs a file of its own", out, in);
  return {};
}

// On standard error; returns the code.
inline ExitCode complain(ExitCode code, const std::string& text) {
  fmt::print(stderr, "clothstream: {}\n", text);
  return code;
}
inline ExitCode say(const Complaint& complaint) {
  return complain(complaint.code, complaint.text);
}

}  // namespace clothstream::cli
