// SPDX-License-Identifier: MIT
// Adds the options of `clothstream set`. The tables of parameters give those of the numbers of a cloth and of
// the environment.
#include "clients/cli/set_options.h"

#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/environment_parameters.h"
#include "proto/parameters/settings.h"

namespace clothstream::cli {
namespace {

// Range with its unit, such as "0 to 10 m".
template <typename Parameter>
std::string rangeOf(const Parameter& parameter) {
  return fmt::format("{:g} to {:g}{}{}", parameter.range.min, parameter.range.max,
                     parameter.unit.empty() ? "" : " ", parameter.unit);
}

std::string rangeOf(const parameters::Count& count) {
  return fmt::format("{} to {}", count.min, count.max);
}

void addNumber(CLI::App& app, const parameters::ClothParameter& parameter, cs_cloth_settings& settings) {
  app.add_option(fmt::format("--{}", parameter.option), settingOf(settings, parameter.number),
                 fmt::format("{}, {}", parameter.help, rangeOf(parameter)))
      ->group(std::string(parameter.optionGroup));
}

void addField(CLI::App& app, const parameters::EnvironmentParameter& parameter, std::vector<float>& numbers) {
  std::string help;
  int least = 0;
  for (const parameters::EnvironmentNumber& number : parameter.numbers) {
    if (!number.help.empty()) help += fmt::format("{} {}", number.help, rangeOf(number.setting));
    if (number.isOptional)
      help += fmt::format("; default {:g} {}", number.setting.initial, number.setting.unit);
    else
      ++least;
  }
  app.add_option(fmt::format("--{}", parameter.option), numbers, help)
      ->delimiter(',')
      ->expected(least, static_cast<int>(parameter.numbers.size()))
      ->allow_extra_args(false)  // otherwise an option takes the address behind it
      ->group("Environment");
}

}  // namespace

void addSetOptions(CLI::App& app, SetOptions& options) {
  cs_cloth_settings& settings = options.settings;
  app.add_option("--scene", options.scene, "Name of the scene; default: the server's default scene");
  app.add_option("--cloth", options.cloth, "Name of the cloth; default: every cloth of the scene");

  for (const parameters::ClothParameter& parameter : parameters::kClothParameters)
    addNumber(app, parameter, settings);

  const char* solver = "Solver";
  const std::map<std::string, std::uint32_t> solvers{{"massSpring", CS_SOLVER_MASS_SPRING},
                                                     {"constraint", CS_SOLVER_CONSTRAINT},
                                                     {"acad", CS_SOLVER_ACAD},
                                                     {"xpbd", CS_SOLVER_XPBD},
                                                     {"implicitEuler", CS_SOLVER_IMPLICIT_EULER}};
  app.add_option("--solver", settings.solver, "massSpring, constraint, acad, xpbd or implicitEuler")
      ->transform(CLI::CheckedTransformer(solvers, CLI::ignore_case))
      ->group(solver);
  app.add_option("--iterations", settings.iterations,
                 fmt::format("Maximum iterations per substep, {}; xpbd: {}", rangeOf(parameters::kIterations),
                             rangeOf(parameters::kXpbdIterations)))
      ->check(CLI::PositiveNumber)
      ->group(solver);
  app.add_option("--tolerance", settings.tolerance,
                 fmt::format("Maximum residual relative to its start, {}", rangeOf(parameters::kTolerance)))
      ->group(solver);
  app.add_option("--compliance", settings.compliance,
                 fmt::format("Compliance of constraints, {}", rangeOf(parameters::kCompliance)))
      ->group(solver);
  app.add_option("--activation", settings.activation,
                 fmt::format("For acad: stretch at which a spring becomes a constraint, {}",
                             rangeOf(parameters::kActivation)))
      ->group(solver);
  app.add_option("--bend-constraints", settings.bend_constraints,
                 "1: bend springs are constraints too; 0: they are not")
      ->check(CLI::Range(0, 1))
      ->group(solver);
  app.add_option("--assembled", settings.assembled,
                 "For constraint: 1 multiplies sparse matrices, for comparison; 0 does not")
      ->check(CLI::Range(0, 1))
      ->group(solver);

  app.add_option("--material", options.material,
                 "Name of a material: sets springs, damping, air, friction, mass and solver. Other options "
                 "apply after it")
      ->group("Material");

  app.add_option("--areal-mass", options.arealMass, "Mass per area, 0.0001 to 1000 kg/m^2")
      ->group("Material");

  const char* placed = "Colliders and attachments";
  CLI::Option* const collider =
      app.add_option("--collider", options.collider, "Collider of the scene that gets --position or --radius")
          ->group(placed);
  CLI::Option* const attachment =
      app.add_option("--attachment", options.attachment, "Attachment that moves to --position")
          ->excludes(collider)
          ->group(placed);
  app.add_option("--position", options.position, "X,Y,Z, m")->delimiter(',')->expected(3)->group(placed);
  app.add_option("--orientation", options.orientation,
                 "Quaternion X,Y,Z,W of the attachment; default: no rotation")
      ->delimiter(',')
      ->expected(4)
      ->needs(attachment)
      ->group(placed);
  app.add_flag("--jump", options.jumps, "The attachment jumps: its cloth goes along at once")
      ->needs(attachment)
      ->group(placed);
  app.add_option("--radius", options.radius, "Radius of the collider, 0.001 to 10 m")
      ->needs(collider)
      ->group(placed);

  for (const parameters::EnvironmentParameter& parameter : parameters::kEnvironmentParameters)
    addField(app, parameter, options.environment[parameter.row]);
}

void checkSetOptions(const SetOptions& options) {
  const auto wrong = [](const char* option, const char* text) { throw CLI::ValidationError(option, text); };
  if (!options.collider.empty() && options.position.empty() && !options.radius)
    wrong("--collider", "needs --position or --radius");
  if (!options.attachment.empty() && options.position.empty()) wrong("--attachment", "needs --position");
  if (!options.position.empty() && options.collider.empty() && options.attachment.empty())
    wrong("--position", "needs --collider or --attachment");
  if (!changesAnything(options)) wrong("set", "nothing to change is given; see clothstream set --help");
}

}  // namespace clothstream::cli
