// SPDX-License-Identifier: MIT
// Error of a command: exit code and text.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <tl/expected.hpp>

#include "clients/cli/exit_code.h"
#include "clients/cli/print.h"

namespace clothstream::cli {

struct Error {
  ExitCode code = kOk;
  std::string text;
};

template <typename... Arguments>
tl::unexpected<Error> makeError(ExitCode code, fmt::format_string<Arguments...> text,
                                Arguments&&... arguments) {
  return tl::unexpected(Error{code, fmt::format(text, std::forward<Arguments>(arguments)...)});
}

// Adds the exit code, and advice about the options of the program.
inline Error errorOf(const Failure& failure) {
  return {exitCodeOf(failure.kind),
          failure.text + (failure.needsProof ? ". Use --token FILE, or --pair CODE." : "")};
}

// Adds the exit code to an error text.
template <typename T>
tl::expected<T, Error> orError(ExitCode code, tl::expected<T, std::string> result) {
  return std::move(result).map_error([&](std::string text) { return Error{code, std::move(text)}; });
}

// Returns an error if both paths name the same file, which would be overwritten while it is read.
inline tl::expected<void, Error> areDifferent(const std::string& in, const std::string& out) {
  std::error_code missing;
  if (std::filesystem::equivalent(in, out, missing))
    return makeError(kUsage, "{} and {} are the same file; choose another file for the result", out, in);
  return {};
}

// Prints to standard error and returns the code.
inline ExitCode printError(ExitCode code, const std::string& text) {
  print(stderr, "clothstream: {}\n", text);
  return code;
}
inline ExitCode printError(const Error& error) {
  return printError(error.code, error.text);
}
inline ExitCode printError(const Failure& failure) {
  return printError(errorOf(failure));
}

}  // namespace clothstream::cli
