// SPDX-License-Identifier: MIT
// The table of profiles as text.
#pragma once

#include <string>

#include "server/hosting/limits.h"

namespace clothstream {

// For --help: one line for each limit, with a column for each profile.
std::string profilesAsText();
// For the documentation: a section of Markdown.
std::string profilesAsMarkdown();
// For --print-config: limits that only the profile sets, as comments of TOML.
std::string limitsAsComments(hosting::Profile profile);

}  // namespace clothstream
