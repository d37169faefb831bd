// SPDX-License-Identifier: MIT
// Recorded figures of compiled kernels, as a table in a text file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "tests/kernel_survey/survey.h"

namespace clothstream::kernel_survey {

// RADV's figures of a kernel.
struct Figures {
  std::uint32_t vectorRegisters = 0;
  std::uint32_t sharedBytes = 0;  // per workgroup
  std::uint32_t subgroups = 0;    // that run on a SIMD unit at the same time: occupancy
  std::uint32_t instructions = 0;

  bool operator==(const Figures&) const = default;
};

struct FigureTable {
  std::string driver;                      // name and version, as in vulkan::DeviceInfo
  std::map<std::string, Figures> kernels;  // by name, settings and workgroup size
};

FigureTable tableOf(std::span<const SurveyedKernel> kernels, const std::string& driver);

// Writes one line per kernel, columns separated by tabs. Throws std::runtime_error, which names the file, if
// that fails.
void writeTable(const std::filesystem::path& path, const FigureTable& table);
// Throws std::runtime_error, which names the file and the line, if the file is missing or has another form.
FigureTable readTable(const std::filesystem::path& path);

// One sentence for each kernel whose figures differ, or that only one table has.
std::vector<std::string> differences(const FigureTable& recorded, const FigureTable& now);

}  // namespace clothstream::kernel_survey
