// SPDX-License-Identifier: MIT
// The end of a server whose memory runs out.
#pragma once

#include "server/options/program_options.h"

namespace clothstream::program {

// Exit status of a server whose memory ran out: EX_OSERR of sysexits.h, which systemd prints as OSERR.
inline constexpr int kOutOfMemoryStatus = 71;

// From now on, an allocation of C++ that fails, on any thread, writes one line to standard error and ends the
// process at once with kOutOfMemoryStatus. The line has the form of the log (--log-format), without a time.
void endWhenOutOfMemory(const LogOptions& log);

}  // namespace clothstream::program
