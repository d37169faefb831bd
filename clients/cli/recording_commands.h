// SPDX-License-Identifier: MIT
// `clothstream record`, `info`, `recover` and `export`.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/export.h"
#include "clients/cli/info.h"
#include "clients/cli/record.h"
#include "clients/cli/recover.h"

namespace clothstream::cli {

// The commands, of which one may be parsed. Outlives the parsing.
class RecordingCommands {
 public:
  // `address` is what the server's is read into.
  void add(CLI::App& app, std::string& address);
  bool parsed() const;
  ExitCode run(const std::string& address, const std::string& program);

 private:
  RecordOptions recordOptions_;
  InfoOptions infoOptions_;
  RecoverOptions recoverOptions_;
  ExportOptions exportOptions_;
  CLI::App *record_ = nullptr, *info_ = nullptr, *recover_ = nullptr, *export_ = nullptr;
};

}  // namespace clothstream::cli
