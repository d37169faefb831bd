// SPDX-License-Identifier: MIT
// TLS of both endpoints, as the options ask for it.
#pragma once

#include <memory>

#include "server/options/program_options.h"
#include "server/tls/server_tls.h"

namespace clothstream::program {

// Null without TLS. Throws std::runtime_error that names the option or the file.
std::shared_ptr<tls::ServerTls> openTls(const ServeOptions& options);

// Reads the certificate again. Logs the result; if it fails, the old certificate stays in use.
void reload(tls::ServerTls& tls);

}  // namespace clothstream::program
