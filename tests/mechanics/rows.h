// SPDX-License-Identifier: MIT
// Rows of the tables in docs/mechanics.md.
#pragma once

#include <string>
#include <vector>

namespace clothstream::mechanics {

// Two significant digits, as in the page; "0" for zero.
std::string figure(double value);

// Expects that docs/mechanics.md has this row. Every device computes the same bits, so that figures are equal
// to the last digit.
void expectRow(const std::vector<std::string>& cells);

}  // namespace clothstream::mechanics
