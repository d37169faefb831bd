// SPDX-License-Identifier: MIT
// `clothstream load`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"
#include "clients/load/load.h"

namespace clothstream::cli {

// The command, which may be parsed. Outlives the parsing.
class LoadCommand {
 public:
  void add(CLI::App& app);
  bool parsed() const { return command_->parsed(); }
  // What the options say that no option alone can know. Throws CLI::ValidationError.
  void check();
  // SIGINT and SIGTERM must be blocked in every thread: they end the load early.
  ExitCode run() const;

 private:
  load::LoadOptions options_;
  std::string address_;
  std::optional<std::uint32_t> decoders_;
  std::optional<std::uint32_t> serverPid_;
  bool web_ = false, json_ = false;
  CLI::App* command_ = nullptr;
};

}  // namespace clothstream::cli
