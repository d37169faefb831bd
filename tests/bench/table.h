// SPDX-License-Identifier: MIT
// Rows of a benchmark as text.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

// Prints one line for each row on stdout: names and values, without the device.
void printTable(const Rows& rows);

}  // namespace clothstream::bench
