// SPDX-License-Identifier: MIT
// `clothstream record`, `info`, `recover` and `export`: options of the commands for recordings.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/export.h"
#include "clients/cli/info.h"
#include "clients/cli/record.h"
#include "clients/cli/recover.h"
#include "clients/native/address.h"

namespace clothstream::cli {

// Must outlive the parsing.
class RecordingCommands {
 public:
  // The parser stores the server's address in `address`.
  void add(CLI::App& app, std::string& address);
  bool parsed() const;
  // Returns whether the chosen command connects to a server.
  bool connects() const { return record_->parsed(); }
  ExitCode run(const ServerAddress& address, const std::string& program);

 private:
  RecordOptions recordOptions_;
  InfoOptions infoOptions_;
  RecoverOptions recoverOptions_;
  ExportOptions exportOptions_;
  CLI::App *record_ = nullptr, *info_ = nullptr, *recover_ = nullptr, *export_ = nullptr;
};

}  // namespace clothstream::cli
