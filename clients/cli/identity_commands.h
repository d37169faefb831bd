// SPDX-License-Identifier: MIT
// Commands about identities: `pairing-code`, `bans`, `unban`.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"
#include "clients/native/address.h"

namespace clothstream::cli {

// Must outlive the parsing.
class IdentityCommands {
 public:
  // The commands share `address` with other commands.
  void add(CLI::App& app, std::string& address);
  bool parsed() const;
  ExitCode run(const ServerAddress& address) const;

 private:
  ExitCode makeCode(const ServerAddress& address) const;
  ExitCode listBans(const ServerAddress& address) const;

  std::string role_ = "participant", scene_, subject_;
  CLI::App *pairingCode_ = nullptr, *bans_ = nullptr, *unban_ = nullptr;
};

}  // namespace clothstream::cli
