// SPDX-License-Identifier: MIT
// What the program keeps of servers after pairing: a token, and the key of a server with TLS. One file each.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "clients/native/address.h"

namespace clothstream::cli {

// File of the server's token, in $XDG_STATE_HOME/clothstream/tokens or
// $HOME/.local/state/clothstream/tokens; empty without both variables. Servers with and without TLS have
// different files, so that a token never leaves TLS.
std::filesystem::path tokenFileOf(const ServerAddress& server);
// File of the fingerprint of the server's key, in a directory `servers` next to `tokens`.
std::filesystem::path fingerprintFileOf(const ServerAddress& server);

// Token in the file, without the space around it; "-" reads standard input. Errors name the file and what is
// wrong.
[[nodiscard]] tl::expected<std::string, std::string> readToken(const std::filesystem::path& file);

// Fingerprint that was kept for the server, or empty. The error names a file that has none.
[[nodiscard]] tl::expected<std::string, std::string> keptFingerprint(const ServerAddress& server);

// Writes a token or a fingerprint with mode 0600 and makes missing directories with mode 0700.
[[nodiscard]] tl::expected<void, std::string> saveLine(const std::filesystem::path& file,
                                                       const std::string& line);

}  // namespace clothstream::cli
