// SPDX-License-Identifier: MIT
// Compares each recording with golden.json, and with what the server simulates from its input.
#include "clients/cli/golden.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/child_program.h"
#include "clients/cli/error.h"
#include "clients/cli/golden_manifest.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clients/cli/signals.h"

namespace clothstream::cli {
namespace {

using recording::Verdict;

constexpr int kInterruptedServer = 130;

struct Checked {
  std::string name, text;
  Verdict verdict = Verdict::equal;
};

// Executable of the server: as given, next to this program, or in PATH.
std::string serverOf(const GoldenOptions& options) {
  if (!options.server.empty()) return options.server;
  std::error_code problem;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", problem);
  const auto neighbour = self.parent_path() / "clothstream-server";
  return !problem && std::filesystem::exists(neighbour, problem) ? neighbour.string() : "clothstream-server";
}

// Describes the difference that `resimulate --json` found.
std::string changeOf(const nlohmann::json& result) {
  const nlohmann::json first = result.value("firstDifferent", nlohmann::json());
  if (!first.is_object()) return {};
  std::string text = fmt::format("{} of {} ticks differ, first tick {}", result.value("different", 0),
                                 result.value("ticks", 0), first.value("tick", 0));
  double largest = -1;
  const auto take = [&](const nlohmann::json& difference) {
    if (difference.is_object()) largest = std::max(largest, difference.value("largest", -1.0));
  };
  const nlohmann::json frames = result.value("frames", nlohmann::json::object());
  take(frames.value("largest", nlohmann::json()));
  for (const auto& state : result.value("states", nlohmann::json::array())) take(state);
  if (largest >= 0)
    text += fmt::format("; by at most {:.4g} mm, of which {:.4g} mm may be the codec's", 1000 * largest,
                        1000 * 1.7320508 * frames.value("maxError", 0.0));
  return text;
}

class Check {
 public:
  Check(const GoldenOptions& options, const Manifest& manifest)
      : options_(options), manifest_(manifest), server_(serverOf(options)) {}

  tl::expected<std::vector<Checked>, Error> run() {
    std::error_code problem;
    for (const auto& entry : std::filesystem::directory_iterator(options_.directory, problem))
      if (const std::string name = entry.path().filename().string();
          entry.path().extension() == ".mcap" && !manifest_.contains(name))
        add(name, Verdict::missing, fmt::format("is not in {}; --update adds it", kManifestName));
    if (problem) return makeError(kUnreadable, "cannot read {}: {}", options_.directory, problem.message());
    for (const auto& [name, kept] : manifest_) {
      if (interrupted()) return makeError(kFailed, "interrupted");
      if (auto done = check(name, kept); !done) return tl::unexpected(done.error());
    }
    std::ranges::sort(checked_, {}, &Checked::name);
    return std::move(checked_);
  }

 private:
  void add(const std::string& name, Verdict verdict, std::string text) {
    checked_.push_back({name, std::move(text), verdict});
  }

  tl::expected<void, Error> check(const std::string& name, const GoldenRecording& kept) {
    const std::string path = (std::filesystem::path(options_.directory) / name).string();
    if (!std::filesystem::exists(path)) {
      add(name, Verdict::missing, "the file does not exist");
      return {};
    }
    const auto now = readGolden(path, options_.limits);
    if (!now) {
      add(name, Verdict::missing, now.error());
      return {};
    }
    if (*now != kept) {
      add(name, Verdict::different,
          fmt::format("the recording itself was replaced: it has {} frames and {} ticks with other hashes",
                      now->frames, now->ticks));
      return {};
    }
    if (kept.ticks > 0) return simulate(name, path);
    add(name, Verdict::equal, fmt::format("{} frames; it has no ticks to simulate", kept.frames));
    return {};
  }

  tl::expected<void, Error> simulate(const std::string& name, const std::string& path) {
    std::vector<std::string> command{server_,  "resimulate",     path,
                                     "--json", "--max-vertices", fmt::format("{}", options_.limits.vertices)};
    if (!options_.device.empty()) command.insert(command.end(), {"--device", options_.device});
    const auto ended = runProgram(command);
    if (!ended) return makeError(kFailed, "{}; name the server with --server", ended.error());
    if (ended->exitCode == kInterruptedServer) return makeError(kFailed, "interrupted");
    const auto result = nlohmann::json::parse(ended->text, nullptr, false);
    const auto verdict = static_cast<Verdict>(ended->exitCode);
    const bool known = verdict == Verdict::equal || verdict == Verdict::different ||
                       verdict == Verdict::otherKernels || verdict == Verdict::missing;
    if (!known || !result.is_object() || result.value("exitCode", -1) != ended->exitCode)
      return makeError(kFailed, "{} resimulate {} failed with exit code {}", server_, path, ended->exitCode);
    std::string text = changeOf(result);
    if (text.empty()) text = fmt::format("{} ticks are the same bits", result.value("ticks", 0));
    if (const std::size_t parts = result.value("missing", nlohmann::json::array()).size(); parts > 0)
      text += fmt::format("; {} parts are missing", parts);
    add(name, verdict, std::move(text));
    return {};
  }

  const GoldenOptions& options_;
  const Manifest& manifest_;
  const std::string server_;
  std::vector<Checked> checked_;
};

// The verdict of the folder: a difference outweighs missing data, and one from the same kernels outweighs one
// from other kernels.
Verdict worstOf(const std::vector<Checked>& checked) {
  for (const Verdict verdict : {Verdict::different, Verdict::otherKernels, Verdict::missing})
    if (std::ranges::any_of(checked, [&](const Checked& one) { return one.verdict == verdict; }))
      return verdict;
  return Verdict::equal;
}

void printVerdicts(const std::vector<Checked>& checked, const GoldenOptions& options) {
  const Verdict worst = worstOf(checked);
  if (!options.json) {
    for (const Checked& one : checked) print("{:<14}{}: {}\n", nameOf(one.verdict), one.name, one.text);
    print("{} recordings: {}\n", checked.size(), nameOf(worst));
    return;
  }
  nlohmann::ordered_json json{{"verdict", nameOf(worst)},
                              {"exitCode", static_cast<int>(worst)},
                              {"recordings", nlohmann::ordered_json::array()}};
  for (const Checked& one : checked)
    json["recordings"].push_back({{"name", one.name}, {"verdict", nameOf(one.verdict)}, {"text", one.text}});
  put(jsonText(json, 1) + '\n');
}

}  // namespace

ExitCode golden(const GoldenOptions& options) {
  if (options.update) {
    const auto folder = readFolder(options.directory, options.limits);
    if (!folder) return printError(kUnreadable, folder.error());
    if (folder->empty())
      return printError(kUnreadable, fmt::format("{} has no recordings (*.mcap)", options.directory));
    if (const auto written = writeManifest(options.directory, *folder); !written)
      return printError(kNotWritten, written.error());
    print("{}: {} recordings\n", (std::filesystem::path(options.directory) / kManifestName).string(),
          folder->size());
    return kOk;
  }
  const auto manifest = readManifest(options.directory);
  if (!manifest) return printError(kUnreadable, manifest.error());
  const auto checked = Check(options, *manifest).run();
  if (!checked) return printError(checked.error());
  printVerdicts(*checked, options);
  return exitCodeOf(worstOf(*checked));
}

}  // namespace clothstream::cli
