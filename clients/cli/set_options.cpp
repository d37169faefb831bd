// SPDX-License-Identifier: MIT
// Adds the options of `clothstream set`. The table of parameters gives those of a cloth's numbers.
#include "clients/cli/set_options.h"

#include <map>
#include <string>

#include <fmt/format.h>

#include "proto/parameters/cloth_parameters.h"

namespace clothstream::cli {
namespace {

void addNumber(CLI::App& app, const parameters::ClothParameter& parameter, cs_cloth_settings& settings) {
  const std::string unit = parameter.unit.empty() ? "" : fmt::format(" {}", parameter.unit);
  app.add_option(
         fmt::format("--{}", parameter.option), settingOf(settings, parameter.number),
         fmt::format("{}, {:g} to {:g}{}", parameter.help, parameter.range.min, parameter.range.max, unit))
      ->group(std::string(parameter.optionGroup));
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
                 "Maximum iterations per substep, 1 to 10000; xpbd: 1 to 1000")
      ->check(CLI::PositiveNumber)
      ->group(solver);
  app.add_option("--tolerance", settings.tolerance, "Maximum residual relative to its start, 0 to 1")
      ->group(solver);
  app.add_option("--compliance", settings.compliance, "Compliance of constraints, 0 to 1 m/N")->group(solver);
  app.add_option("--activation", settings.activation,
                 "For acad: stretch at which a spring becomes a constraint, 0 to 10")
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

  const char* environment = "Environment";
  app.add_option("--gravity", options.gravity, "X,Y,Z, each -1000 to 1000 m/s^2")
      ->delimiter(',')
      ->expected(3)
      ->group(environment);
  app.add_option("--wind", options.wind, "X,Y,Z, each -100 to 100 m/s")
      ->delimiter(',')
      ->expected(3)
      ->group(environment);
  app.add_option(
         "--gust", options.gust,
         "STRENGTH[,SECONDS]: maximum deviation of the wind, 0 to 100 m/s, and its duration, 0.01 to 3600 s; "
         "default 2 s")
      ->delimiter(',')
      ->expected(1, 2)
      ->group(environment);
  app.add_option("--air-density", options.airDensity, "Density of the air, 0 to 100 kg/m^3")
      ->group(environment);
}

}  // namespace clothstream::cli
