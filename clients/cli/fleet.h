// SPDX-License-Identifier: MIT
// `clothstream list --nats` and `clothstream move`: the directory of a fleet, in NATS.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

class FleetCommands {
 public:
  // Adds `move`, and the options of NATS to `list`.
  void add(CLI::App& app, CLI::App& list);
  bool parsed() const { return move_->parsed() || (list_->parsed() && !servers_.empty()); }
  // Prints servers and scenes, or moves a scene.
  ExitCode run(bool json) const;

 private:
  ExitCode list(bool json) const;
  ExitCode move() const;

  CLI::App *list_ = nullptr, *move_ = nullptr;
  std::vector<std::string> servers_;
  std::string credentials_, authority_;
  std::string scene_, to_;
};

}  // namespace clothstream::cli
