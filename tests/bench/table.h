// SPDX-License-Identifier: MIT
// Rows of a benchmark for people.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

// A line a row on stdout: names and values, the device left out.
void printTable(const Rows& rows);

}  // namespace clothstream::bench
