// SPDX-License-Identifier: MIT
// `clothstream load`: command-line options of the load test.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"
#include "clients/load/load.h"
#include "clients/native/address.h"

namespace clothstream::cli {

// Must outlive the parsing.
class LoadCommand {
 public:
  void add(CLI::App& app);
  bool parsed() const { return command_->parsed(); }
  // Checks the options together, and fills in the default address. Throws CLI::ValidationError.
  void check();
  // As the user wrote it.
  const std::string& address() const { return address_; }
  bool usesWeb() const { return web_; }
  // SIGINT and SIGTERM must be blocked in every thread; they end the test early.
  ExitCode run(const ServerAddress& address) const;

 private:
  load::LoadOptions options_;
  std::string address_;
  std::string framesPath_;  // empty: none
  std::optional<std::uint32_t> participants_, viewers_, decoders_;
  std::optional<std::uint32_t> serverPid_;
  bool web_ = false, json_ = false;
  CLI::App* command_ = nullptr;
};

}  // namespace clothstream::cli
