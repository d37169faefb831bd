// SPDX-License-Identifier: MIT
// Names of threads, by which operators find them.
#pragma once

namespace clothstream::telemetry {

// Names the calling thread, with at most 15 bytes. `top -H`, debuggers and /proc/PID/task/*/comm show the
// name.
void nameThread(const char* name);

}  // namespace clothstream::telemetry
