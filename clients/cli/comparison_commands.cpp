// SPDX-License-Identifier: MIT
#include "clients/cli/comparison_commands.h"

#include <csignal>
#include <filesystem>
#include <map>
#include <string>

#include "clients/cli/recording_limits.h"

namespace clothstream::cli {
namespace {

// A number with a unit of length; without a unit it is in metres.
CLI::AsNumberWithUnit length() {
  const std::map<std::string, double> units{{"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}};
  return CLI::AsNumberWithUnit(units, CLI::AsNumberWithUnit::CASE_SENSITIVE, "LENGTH");
}

// Options that .npz files may need.
void addArrayOptions(CLI::App& command, ArrayOptions& options) {
  command.add_option("--mesh", options.mesh,
                     "OBJ file with the cloth at rest, if the .npz has no triangles and rest_positions");
  command.add_option("--rate", options.rate, "Ticks per second, if the .npz has no rate")
      ->check(CLI::PositiveNumber);
  command.add_option(
      "--first-tick", options.first,
      "Tick of the first frame; each further frame is one tick later. Default: the ticks of the "
      ".npz, or 1");
}

// Name of the scene of an imported file: its own name, with the characters that a scene may have.
std::string sceneNameOf(const std::string& path) {
  constexpr std::size_t kMaxCharacters = 64;
  std::string name = std::filesystem::path(path).stem().string().substr(0, kMaxCharacters);
  for (char& character : name) {
    if (character >= 'A' && character <= 'Z') character = static_cast<char>(character - 'A' + 'a');
    const bool allowed = (character >= 'a' && character <= 'z') || (character >= '0' && character <= '9');
    if (!allowed && character != '_' && character != '-') character = '_';
  }
  return name.empty() ? "imported" : name;
}

}  // namespace

void ComparisonCommands::add(CLI::App& app) {
  addDiff(app);
  addMeasure(app);
  addImport(app);
  addGolden(app);
}

void ComparisonCommands::addDiff(CLI::App& app) {
  diff_ = app.add_subcommand("diff", "Compare two recordings tick by tick");
  diff_->add_option("A", diffOptions_.a, "The first recording")->required();
  diff_->add_option("B", diffOptions_.b, "The second recording")->required();
  diff_
      ->add_option("--tolerance", diffOptions_.tolerance,
                   "Largest distance of a vertex that counts as equal: a number with um, mm, cm or m, or in "
                   "metres. Default: 0, which compares bits and the hashes of states")
      ->transform(length())
      ->check(CLI::NonNegativeNumber);
  diff_->add_flag("--json", diffOptions_.json, "Print one JSON object");
  addLimits(*diff_, diffOptions_.limits);
}

void ComparisonCommands::addMeasure(CLI::App& app) {
  measure_ =
      app.add_subcommand("measure", "Measure strain, penetration, intersections and energy of a motion");
  measure_->add_option("FILE", measureOptions_.file, "A recording, or a .npz file with positions")
      ->required();
  addArrayOptions(*measure_, measureOptions_.arrays);
  measure_
      ->add_option("--areal-mass", measureOptions_.arealMass,
                   "Mass per area at rest, kg/m^2, for energies. Default: that of the recorded scene, or 0.2")
      ->check(CLI::PositiveNumber);
  measure_
      ->add_option("--gravity", gravity_,
                   "Acceleration X,Y,Z, m/s^2. Default: that of the recorded scene, or 0,-9.81,0")
      ->delimiter(',')
      ->expected(3);
  measure_->add_flag("!--no-intersections", measureOptions_.intersections,
                     "Leave out intersections, which take most of the time");
  CLI::Option* const json = measure_->add_flag("--json", json_, "Print one JSON object with every frame");
  measure_->add_flag("--csv", csv_, "Print a row for each frame and cloth")->excludes(json);
  addLimits(*measure_, measureOptions_.limits);
}

void ComparisonCommands::addImport(CLI::App& app) {
  import_ = app.add_subcommand("import", "Make a recording of positions in a .npz file");
  import_
      ->add_option("FILE", importOptions_.states,
                   "The .npz file: array positions (frames, vertices, 3), metres")
      ->required();
  import_->add_option("-o,--output", importOptions_.output, "Recording to write; must not exist")
      ->type_name("FILE")
      ->required();
  addArrayOptions(*import_, importOptions_.arrays);
  import_->add_option("--scene", importOptions_.scene, "Name of the scene. Default: the name of FILE");
  import_
      ->add_option("--max-error", importOptions_.maxError,
                   "Max error, 5um to 1m: a number with um, mm, cm or m, or in metres. A vertex is at most "
                   "sqrt(3) times that away from its place. Default: 10um")
      ->transform(length())
      ->check(CLI::Range(5e-6, 1.0));
  addLimits(*import_, importOptions_.limits);
}

void ComparisonCommands::addGolden(CLI::App& app) {
  golden_ =
      app.add_subcommand("golden", "Say which recordings of a folder are no longer simulated as they were");
  golden_->add_option("DIR", goldenOptions_.directory, "Folder with recordings (*.mcap) and golden.json")
      ->required();
  golden_->add_flag("--update", goldenOptions_.update,
                    "Write golden.json for the recordings that the folder has now");
  golden_
      ->add_option("--server", goldenOptions_.server,
                   "clothstream-server, which simulates again. Default: next to this program, or in PATH")
      ->type_name("PROGRAM");
  golden_->add_option("--device", goldenOptions_.device,
                      "Vulkan device of the server: index or part of its name");
  golden_->add_flag("--json", goldenOptions_.json, "Print one JSON object");
  addLimits(*golden_, goldenOptions_.limits);
}

ExitCode ComparisonCommands::run(const std::string& program) {
  // Makes a file size limit an error like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  if (diff_->parsed()) return diff(diffOptions_);
  if (measure_->parsed()) {
    if (gravity_.size() == 3) measureOptions_.gravity = {gravity_[0], gravity_[1], gravity_[2]};
    measureOptions_.format = json_ ? MeasureFormat::json : csv_ ? MeasureFormat::csv : MeasureFormat::text;
    return measureFile(measureOptions_);
  }
  if (golden_->parsed()) return golden(goldenOptions_);
  importOptions_.program = program;
  importOptions_.scene =
      sceneNameOf(importOptions_.scene.empty() ? importOptions_.states : importOptions_.scene);
  return importStates(importOptions_);
}

}  // namespace clothstream::cli
