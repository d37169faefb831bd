// SPDX-License-Identifier: MIT
// Identity of peers, as the options ask for it: keys of tokens, and pairing codes on standard output.
#pragma once

#include <memory>
#include <string>

#include "server/identity/authenticator.h"
#include "server/options/program_options.h"

namespace clothstream::program {

// Null if every peer may act as an owner, because only programs of this machine reach the server. Logs
// warnings about servers that others reach without tokens or without encryption.
std::shared_ptr<identity::Authenticator> makeAuthenticator(const ServeOptions& options);

// Reads the keys of tokens again. Logs the result; if it fails, the old keys stay in use.
void reload(identity::Authenticator& authenticator);

// Makes a pairing code for an owner, and returns the line that shows it: a person who sees the output of the
// server controls it. Empty if the server does not pair.
std::string pairingCodeLine(identity::Authenticator& authenticator);

}  // namespace clothstream::program
