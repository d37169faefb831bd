// SPDX-License-Identifier: MIT
// `clothstream create`, `delete`, `pause`, `resume`, `reset`: scenes of a server; `seek`, `speed` and `loop`:
// those that are recordings.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct SceneOptions {
  std::string address;                // as completeAddress gives it
  std::string file;                   // create: of a scene, in JSON
  std::string named;                  // create: instead of a file, one that the server knows
  std::string name;                   // of the scene; create: instead of its own
  std::uint32_t maxParticipants = 0;  // create; 0: the server's limit
  double seek = 0;                    // s
  double speed = 1;
  bool loop = false;
  std::string recording;  // start-recording: the file's name; empty: the server's choice
};

// The commands, of which one may be parsed. Both outlive the parsing.
class SceneCommands {
 public:
  // `address` is shared with the other commands.
  void add(CLI::App& app, std::string& address);
  // Throws CLI::ValidationError where what is given does not make sense together.
  void check() const;
  bool parsed() const;
  ExitCode run(const std::string& address);

 private:
  ExitCode create() const;
  ExitCode control(const std::string& address) const;
  ExitCode record(const std::string& address) const;

  SceneOptions options_;
  CLI::App *create_ = nullptr, *delete_ = nullptr, *pause_ = nullptr, *resume_ = nullptr, *reset_ = nullptr;
  CLI::App *seek_ = nullptr, *speed_ = nullptr, *loop_ = nullptr;
  CLI::App *startRecording_ = nullptr, *stopRecording_ = nullptr;
};

}  // namespace clothstream::cli
