// SPDX-License-Identifier: MIT
// `clothstream diff`, `measure`, `import` and `golden`: options of the commands that compare motions.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "clients/cli/diff.h"
#include "clients/cli/golden.h"
#include "clients/cli/import.h"
#include "clients/cli/measure.h"

namespace clothstream::cli {

// Must outlive the parsing.
class ComparisonCommands {
 public:
  void add(CLI::App& app);
  bool parsed() const {
    return diff_->parsed() || measure_->parsed() || import_->parsed() || golden_->parsed();
  }
  // `program` is the name and version of this program.
  ExitCode run(const std::string& program);

 private:
  void addDiff(CLI::App& app);
  void addMeasure(CLI::App& app);
  void addImport(CLI::App& app);
  void addGolden(CLI::App& app);

  DiffOptions diffOptions_;
  MeasureOptions measureOptions_;
  ImportOptions importOptions_;
  GoldenOptions goldenOptions_;
  std::vector<double> gravity_;
  bool json_ = false, csv_ = false;
  CLI::App *diff_ = nullptr, *measure_ = nullptr, *import_ = nullptr, *golden_ = nullptr;
};

}  // namespace clothstream::cli
