// SPDX-License-Identifier: MIT
// Forwards IP packets between two devices under conditions.
#pragma once

#include <cstdint>

#include "tests/link/direction.h"

namespace clothstream::link {

// From one device to another one.
struct Way {
  int from, to;  // descriptors that do not block; a read returns one IP packet, a write takes one
  Direction direction;
  DelayHistogram late{};      // time from when a packet should have left until it did
  std::uint64_t refused = 0;  // packets that the other device did not take, for example because it is down
};

// Forwards until `signals`, a descriptor, can be read. Multicast packets are ignored, because the kernel
// sends some when it likes, and they would change the numbers of the others. Throws std::runtime_error if a
// device fails.
void forward(Way& down, Way& up, int signals);

}  // namespace clothstream::link
