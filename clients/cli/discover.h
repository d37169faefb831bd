// SPDX-License-Identifier: MIT
// `clothstream discover`: servers that are announced in this network.
#pragma once

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

class DiscoverCommand {
 public:
  void add(CLI::App& app);
  bool parsed() const { return command_->parsed(); }
  // Prints the servers that answer in time.
  ExitCode run() const;

 private:
  CLI::App* command_ = nullptr;
  double seconds_ = 3;
  bool json_ = false;
};

}  // namespace clothstream::cli
