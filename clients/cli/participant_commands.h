// SPDX-License-Identifier: MIT
// Commands about the participants of a scene: `participants`, `role`, `remove`, `ban`. They join the scene.
#pragma once

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/exit_code.h"
#include "clients/core/core.h"
#include "clients/native/address.h"
#include "clients/native/native_client.h"

namespace clothstream::cli {

// Must outlive the parsing.
class ParticipantCommands {
 public:
  // The commands share `address` with other commands.
  void add(CLI::App& app, std::string& address);
  bool parsed() const;
  ExitCode run(const ServerAddress& address) const;

 private:
  NativeClientOptions clientOptions(cs_role role) const;
  ExitCode list(const ServerAddress& address) const;
  // Asks for the change and waits for its effect or the server's refusal.
  ExitCode change(const ServerAddress& address) const;

  std::string scene_, role_;
  std::uint64_t participant_ = 0;
  std::uint32_t maxVertices_ = 0;  // 0: the default of cs_limits
  bool json_ = false;
  CLI::App *participants_ = nullptr, *setRole_ = nullptr, *remove_ = nullptr, *ban_ = nullptr;
};

}  // namespace clothstream::cli
