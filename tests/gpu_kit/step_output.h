// SPDX-License-Identifier: MIT
// Rows of clothstream-bench and results of tests, from the output of the steps of a run.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/gpu_kit/comparison.h"

namespace clothstream::gpu_kit {

struct StepOutput {
  Rows rows;
  std::size_t passed = 0;           // tests
  std::size_t skipped = 0;          // tests
  std::vector<std::string> failed;  // names of tests
};

// Adds what is in the file to `output`. The output of a program that was stopped may end in a line: it counts
// if it is a whole row. Throws std::runtime_error if the file cannot be read.
void readStep(const std::filesystem::path& path, StepOutput& output);

}  // namespace clothstream::gpu_kit
