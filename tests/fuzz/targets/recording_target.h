// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// MCAP files: the reader, recovering, playback in any order, and the messages that simulating again needs.
extern const Target kRecordingTarget;

}  // namespace clothstream::fuzz
