// SPDX-License-Identifier: MIT
// Options of `clothstream set`.
#pragma once

#include <CLI/CLI.hpp>

#include "clients/cli/set.h"

namespace clothstream::cli {

// `options` must outlive the parsing.
void addSetOptions(CLI::App& app, SetOptions& options);
// Checks the options together. Throws CLI::ValidationError.
void checkSetOptions(const SetOptions& options);

}  // namespace clothstream::cli
