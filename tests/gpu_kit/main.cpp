// SPDX-License-Identifier: MIT
// gpu-kit-report: turns the output of a run's steps into files like those of tests/bench/results, compares
// them with the committed ones, and says what is wrong or slower.
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/gpu_kit/comparison.h"
#include "tests/gpu_kit/step_output.h"

namespace {

using namespace clothstream::gpu_kit;
namespace fs = std::filesystem;

// How a step ended, as `run` writes it into OUT/steps.txt: a line has name, state and seconds.
struct Step {
  std::string name;
  std::string state;  // complete, cut_short, failed or not_run
  int seconds = 0;
};

std::vector<Step> readSteps(const fs::path& out) {
  std::ifstream file(out / "steps.txt");
  std::vector<Step> steps;
  for (Step step; file >> step.name >> step.state >> step.seconds;) steps.push_back(step);
  if (steps.empty()) throw std::runtime_error((out / "steps.txt").string() + " has no steps");
  return steps;
}

// Folder of committed figures.
struct Kept {
  std::string name;
  Row run;  // run.json
  Rows rows;
};

std::vector<Kept> readKept(const fs::path& folder) {
  std::vector<Kept> all;
  for (const auto& device : fs::directory_iterator(folder)) {
    Kept kept{.name = device.path().filename().string(), .run = {}, .rows = {}};
    for (const auto& file : fs::directory_iterator(device)) {
      const Row json = Row::parse(std::ifstream(file.path()));
      if (file.path().filename() == "run.json")
        kept.run = json;
      else
        kept.rows.insert(kept.rows.end(), json.begin(), json.end());
    }
    all.push_back(std::move(kept));
  }
  return all;
}

std::string deviceOf(const Rows& rows) {
  const auto found = std::ranges::find_if(rows, [](const Row& row) { return row.contains("device"); });
  return found == rows.end() ? "" : found->at("device").get<std::string>();
}

void write(const fs::path& path, const Row& json) {
  std::ofstream file(path);
  file << json.dump(1) << '\n';
  if (!file.flush()) throw std::runtime_error(path.string() + " cannot be written");
}

void say(const std::string& topic, const std::string& text) {
  fmt::print("{:<8} {}\n", topic, text);
}

// Returns the number of scenes whose state is wrong.
std::size_t reportStates(const Rows& rows) {
  std::size_t states = 0, wrong = 0;
  for (const Row& row : rows) {
    if (row.value("topic", "") != "acceptance") continue;
    ++states;
    if (row.value("level", "") == "ok") continue;
    ++wrong;
    say("WRONG", row.value("text", ""));
  }
  say("hashes",
      fmt::format("{} of {} scenes have the state that every device must reach", states - wrong, states));
  return wrong;
}

void reportTests(const StepOutput& output) {
  for (const std::string& name : output.failed) say("FAILED", name);
  say("tests",
      fmt::format("{} passed, {} failed, {} skipped", output.passed, output.failed.size(), output.skipped));
}

// Returns the number of steps that failed.
std::size_t reportSteps(const std::vector<Step>& steps) {
  std::size_t failed = 0;
  std::string missing;
  for (const Step& step : steps) {
    if (step.state == "cut_short")
      say("cut", fmt::format("{} was cut short after {} s", step.name, step.seconds));
    if (step.state == "not_run") missing += (missing.empty() ? "" : ", ") + step.name;
    if (step.state != "failed") continue;
    ++failed;
    say("FAILED", fmt::format("{}: steps/{}.log says why", step.name, step.name));
  }
  if (!missing.empty()) say("not run", missing);
  return failed;
}

void reportTimes(const std::vector<Kept>& all, const Rows& rows, const std::string& against) {
  if (rows.empty()) return;
  const std::string device = deviceOf(rows);
  std::string names;
  const Kept* kept = nullptr;
  for (const Kept& candidate : all) {
    names += (names.empty() ? "" : ", ") + candidate.name;
    if (against.empty() ? deviceOf(candidate.rows) == device : candidate.name == against) kept = &candidate;
  }
  if (kept == nullptr) {
    say("times", fmt::format("there are no committed figures of {}; --against compares with those of {}",
                             against.empty() ? device : against, names));
    return;
  }
  const Comparison comparison = compare(kept->rows, rows);
  for (const Slower& slower : comparison.slower)
    say("slower", fmt::format("{}: {} was {:.4g} and is {:.4g}, {:.2f} times the time", slower.row,
                              slower.figure, slower.before, slower.now, slower.times));
  say("times",
      fmt::format(
          "of {} figures {} are slower and {} faster by more than {} times than with commit {} of {} ({})",
          comparison.figures, comparison.slower.size(), comparison.faster, kNoticed,
          kept->run.value("commit", ""), kept->run.value("date", ""), kept->name));
}

int run(const fs::path& out, const fs::path& keptFolder, const std::string& against,
        const std::string& commit, const std::string& date) {
  const std::vector<Kept> kept = readKept(keptFolder);
  const std::vector<Step> steps = readSteps(out);
  StepOutput output;
  Row report{{"machine", "unknown"}, {"commit", commit}, {"date", date}, {"steps", Row::array()}};
  for (const Step& step : steps) {
    report["steps"].push_back({{"name", step.name}, {"state", step.state}, {"seconds", step.seconds}});
    if (step.state != "not_run") readStep(out / "steps" / (step.name + ".txt"), output);
  }
  std::map<std::string, Row> suites;
  for (const Row& row : output.rows) {
    if (row.value("topic", "") == "machine") report["machine"] = row["text"];
    suites.try_emplace(row["suite"].get<std::string>(), Row::array()).first->second.push_back(row);
  }
  report["tests"] = {{"passed", output.passed}, {"skipped", output.skipped}, {"failed", output.failed}};
  for (const auto& [suite, rows] : suites) write(out / (suite + ".json"), rows);
  write(out / "run.json", report);

  say("machine", report["machine"].get<std::string>());
  reportTimes(kept, output.rows, against);
  reportTests(output);
  const std::size_t wrong = reportStates(output.rows), failed = reportSteps(steps);
  return wrong + failed + output.failed.size() > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Reports on a run of the kit for GPUs: files of rows, what is wrong, and what became slower."};
  fs::path out, kept;
  std::string against, commit, date;
  app.add_option("out", out, "Folder with the output of the steps; the files go there")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("kept", kept, "Folder with the committed figures, one folder for each device")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--against", against, "Folder of the committed figures (default: that of the same device)");
  app.add_option("--commit", commit, "Commit of the programs")->required();
  app.add_option("--date", date, "Date of the run")->required();
  app.footer(
      "Exit code: 0, or 1 if a state is wrong, or a test or a step failed. Slower times do not count.");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(out, kept, against, commit, date);
  } catch (const std::exception& error) {
    fmt::print(stderr, "gpu-kit-report: {}\n", error.what());
    return 2;
  }
}
