// SPDX-License-Identifier: MIT
// A tick's report as it travels with a frame.
#pragma once

#include <span>

#include "clothstream/v1/session.pb.h"
#include "server/simulation/cloth_report.h"

namespace clothstream::stream {

// Replaces what `message` says, and reuses its memory.
void write(std::span<const simulation::ClothReport> reports, double deviceSeconds,
           v1::SimulationReport& message);

}  // namespace clothstream::stream
