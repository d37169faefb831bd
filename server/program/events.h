// SPDX-License-Identifier: MIT
// Events of the program for a backend.
#pragma once

#include <memory>

#include "server/events/events.h"
#include "server/options/program_options.h"

namespace clothstream::program {

// Null without --events-url. Throws std::runtime_error if the file of the secret cannot be used.
std::shared_ptr<events::Events> openEvents(const ServeOptions& options);

}  // namespace clothstream::program
