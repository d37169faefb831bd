// SPDX-License-Identifier: MIT
// `clothstream encode` and `decode`: options of the commands for motion files.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/decode.h"
#include "clients/cli/encode.h"

namespace clothstream::cli {

// Must outlive the parsing.
class MotionCommands {
 public:
  void add(CLI::App& app);
  bool parsed() const { return encode_->parsed() || decode_->parsed(); }
  ExitCode run() const;

 private:
  EncodeOptions encodeOptions_;
  DecodeOptions decodeOptions_;
  CLI::App *encode_ = nullptr, *decode_ = nullptr;
};

}  // namespace clothstream::cli
