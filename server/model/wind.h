// SPDX-License-Identifier: MIT
// Wind in a tick: mean and gust.
#pragma once

#include <cstdint>

#include "server/model/scene.h"

namespace clothstream::model {

// Environment during a tick. `wind` is the mean plus the gust's deviation at that tick, and `gust` is empty.
// Without a gust `wind` is exactly the mean.
//
// The deviation of each component is `strength` times a noise from -1 to 1. The noise interpolates hashed
// values with smoothstep. Their period is `seconds` in whole ticks, at least one. A second noise of half the
// strength and a third of the period is added, and the sum is scaled to -1 to 1. The noise uses integers only
// and depends on tick, component and period only, so every machine and every run gets the same bits. A change
// of `seconds` jumps to another place in the noise.
Environment environmentAt(const Scene& scene, std::uint64_t tick);

}  // namespace clothstream::model
