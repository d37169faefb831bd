// SPDX-License-Identifier: MIT
// Commands for scenes of a server: `print-scene`, `create`, `delete`, `pause`, `resume`, `reset`,
// `start-recording`, `stop-recording`; for scenes that play a recording: `seek`, `speed`, `loop`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"
#include "clients/native/address.h"

namespace clothstream::cli {

struct SceneOptions {
  ServerAddress address = std::string(kDefaultAddress);
  std::string file;                   // create: scene in JSON
  std::string named;                  // create: built-in scene instead of a file
  std::string name;                   // scene; create: new name of the scene
  std::uint32_t maxParticipants = 0;  // create; 0: the server's limit
  bool repair = false, fit = false;   // create
  double seek = 0;                    // s
  double speed = 1;
  bool loop = false;
  std::string recording;  // start-recording: name of the file; empty: the server chooses
};

// Must outlive the parsing, like the address.
class SceneCommands {
 public:
  // The commands share `address` with other commands.
  void add(CLI::App& app, std::string& address);
  // Checks the options together. Throws CLI::ValidationError.
  void check() const;
  bool parsed() const;
  ExitCode run(const ServerAddress& address);

 private:
  ExitCode print(const ServerAddress& address) const;
  ExitCode create() const;
  ExitCode control(const ServerAddress& address) const;
  ExitCode record(const ServerAddress& address) const;

  SceneOptions options_;
  CLI::App *print_ = nullptr, *create_ = nullptr, *delete_ = nullptr, *pause_ = nullptr, *resume_ = nullptr,
           *reset_ = nullptr;
  CLI::App *seek_ = nullptr, *speed_ = nullptr, *loop_ = nullptr;
  CLI::App *startRecording_ = nullptr, *stopRecording_ = nullptr;
};

}  // namespace clothstream::cli
