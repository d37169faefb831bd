// SPDX-License-Identifier: MIT
// Recorded figures of compiled kernels, as a table in a text file.
#include "tests/kernel_survey/figures.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

namespace clothstream::kernel_survey {
namespace {

constexpr const char* kColumns =
    "kernel\tvector registers\tshared bytes\tsubgroups a SIMD unit\tinstructions";

std::string nameOf(const SurveyedKernel& kernel) {
  return fmt::format("{} [{}] {}", kernel.kernel, kernel.settings, kernel.workgroupSize);
}

std::uint32_t wholeNumber(const SurveyedKernel& kernel, const char* statistic) {
  return static_cast<std::uint32_t>(kernel.statistic(statistic).value_or(0));
}

std::string textOf(const Figures& figures) {
  return fmt::format("{} registers, {} shared bytes, {} subgroups, {} instructions", figures.vectorRegisters,
                     figures.sharedBytes, figures.subgroups, figures.instructions);
}

bool isWorse(const Figures& now, const Figures& recorded) {
  return now.vectorRegisters > recorded.vectorRegisters || now.sharedBytes > recorded.sharedBytes ||
         now.subgroups < recorded.subgroups || now.instructions > recorded.instructions;
}

}  // namespace

FigureTable tableOf(std::span<const SurveyedKernel> kernels, const std::string& driver) {
  FigureTable table{driver, {}};
  for (const SurveyedKernel& kernel : kernels)
    table.kernels[nameOf(kernel)] = {.vectorRegisters = wholeNumber(kernel, "VGPRs"),
                                     .sharedBytes = wholeNumber(kernel, "LDS size"),
                                     .subgroups = wholeNumber(kernel, "Subgroups per SIMD"),
                                     .instructions = wholeNumber(kernel, "Instructions")};
  return table;
}

void writeTable(const std::filesystem::path& path, const FigureTable& table) {
  std::ofstream file(path);
  file << table.driver << '\n' << kColumns << '\n';
  for (const auto& [name, figures] : table.kernels)
    file << fmt::format("{}\t{}\t{}\t{}\t{}\n", name, figures.vectorRegisters, figures.sharedBytes,
                        figures.subgroups, figures.instructions);
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{} cannot be written", path.string()));
}

FigureTable readTable(const std::filesystem::path& path) {
  std::ifstream file(path);
  FigureTable table;
  std::string line;
  if (!std::getline(file, table.driver) || !std::getline(file, line) || line != kColumns)
    throw std::runtime_error(
        fmt::format("{} is not a table of kernels: its first line is the driver, its second line \"{}\"",
                    path.string(), kColumns));
  for (std::size_t number = 3; std::getline(file, line); ++number) {
    std::istringstream columns(line);
    std::string name;
    Figures figures;
    std::getline(columns, name, '\t');
    columns >> figures.vectorRegisters >> figures.sharedBytes >> figures.subgroups >> figures.instructions;
    if (!columns) throw std::runtime_error(fmt::format("{}:{}: not a kernel", path.string(), number));
    table.kernels[name] = figures;
  }
  return table;
}

std::vector<std::string> differences(const FigureTable& recorded, const FigureTable& now) {
  std::vector<std::string> all;
  for (const auto& [name, figures] : now.kernels) {
    const auto before = recorded.kernels.find(name);
    if (before == recorded.kernels.end())
      all.push_back(fmt::format("{} is new: {}", name, textOf(figures)));
    else if (before->second != figures)
      all.push_back(fmt::format("{} is {}: {}, recorded {}", name,
                                isWorse(figures, before->second) ? "worse" : "better", textOf(figures),
                                textOf(before->second)));
  }
  for (const auto& [name, figures] : recorded.kernels)
    if (!now.kernels.contains(name)) all.push_back(fmt::format("{} no longer exists", name));
  return all;
}

}  // namespace clothstream::kernel_survey
