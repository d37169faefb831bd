// SPDX-License-Identifier: MIT
// Fills the facts of the panel from a cs_client.
#pragma once

#include <cstdint>

#include <clothstream/core.h>

#include "clients/xr/panel/panel.h"

namespace clothstream::xr {

// Reads scenes, people and figures of an acquired client. Call it a few times a second. Members
// that the client does not know (trouble, advice, canRetry, canRecenter, quality) stay; `status` is replaced
// by figures in short.
void readPanelFacts(cs_client* client, std::uint64_t nowUs, PanelFacts& facts);

}  // namespace clothstream::xr
