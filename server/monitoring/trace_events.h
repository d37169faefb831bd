// SPDX-License-Identifier: MIT
// Traces of scenes in the Trace Event Format, which Perfetto and browsers open.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/scene/live_scene.h"

namespace clothstream::monitoring {

// JSON of the spans of these scenes that end at `begin` or later. A scene is a process, and what works for it
// is a thread. Times are microseconds of the server's clock.
std::string traceEvents(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                        std::chrono::steady_clock::time_point begin);

}  // namespace clothstream::monitoring
