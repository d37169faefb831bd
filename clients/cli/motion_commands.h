// SPDX-License-Identifier: MIT
// `clothstream encode` and `decode`: motions in files, without a server.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/decode.h"
#include "clients/cli/encode.h"

namespace clothstream::cli {

// The commands, of which one may be parsed. Outlives the parsing.
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
