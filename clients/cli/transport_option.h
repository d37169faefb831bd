// SPDX-License-Identifier: MIT
// The option --transport of commands that receive a stream.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/datagram/datagram_transport.h"

namespace clothstream::cli {

// `use` must outlive the parsing.
inline void addTransport(CLI::App& command, Datagrams& use) {
  command
      .add_option_function<std::string>(
          "--transport",
          [&use](const std::string& name) {
            use = name == "auto"        ? Datagrams::automatic
                  : name == "datagrams" ? Datagrams::required
                                        : Datagrams::off;
          },
          "auto: frames and input travel in datagrams if server and network allow them; datagrams: an error "
          "if "
          "they do not; tcp: never")
      ->check(CLI::IsMember({"auto", "datagrams", "tcp"}))
      ->default_str("auto");
}

}  // namespace clothstream::cli
