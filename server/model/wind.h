// SPDX-License-Identifier: MIT
// The wind of a tick: its mean and its gust.
#pragma once

#include <cstdint>

#include "server/model/scene.h"

namespace clothstream::model {

// What holds during a tick: `wind` is the mean plus what it strays by then, and the gust is none. The mean to
// the bit where there is no gust.
//
// Each component strays by strength times a noise from -1 to 1: values hashed from the number of a turn and
// of the component, a turn being `seconds` in whole ticks (at least one), joined by smoothstep; and on top,
// half as strong, the same with turns a third as long, the sum scaled back to -1 to 1. All of it is done in
// whole numbers and depends on nothing else, so that every machine and every run has the same bits; other
// `seconds` go on elsewhere in the noise.
Environment environmentAt(const Scene& scene, std::uint64_t tick);

}  // namespace clothstream::model
