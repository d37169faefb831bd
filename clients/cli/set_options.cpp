// SPDX-License-Identifier: MIT
// Parameters by name.
#include "clients/cli/set_options.h"

#include <map>
#include <string>

namespace clothstream::cli {

void addSetOptions(CLI::App& app, SetOptions& options) {
  cs_cloth_settings& settings = options.settings;
  app.add_option("--scene", options.scene, "The scene; the server's default if left out");
  app.add_option("--cloth", options.cloth, "Name of the cloth; every cloth of the scene if left out");

  const char* springs = "Springs (N/m, N s/m)";
  app.add_option("--stiffness", settings.structural[0], "Of structural springs")->group(springs);
  app.add_option("--spring-damping", settings.structural[1], "Of structural springs")->group(springs);
  app.add_option("--shear", settings.shear[0], "Stiffness of shear springs")->group(springs);
  app.add_option("--shear-damping", settings.shear[1], "Of shear springs")->group(springs);
  app.add_option("--bend", settings.bend[0], "Stiffness of bend springs")->group(springs);
  app.add_option("--bend-damping", settings.bend[1], "Of bend springs")->group(springs);

  app.add_option("--dihedral-bending", settings.dihedral_bending, "Flexural rigidity across edges, N m")
      ->group(springs);
  app.add_option("--tether-slack", settings.tether_slack,
                 "Of a cloth with tethers: what they allow beyond the way along the cloth, a part of it")
      ->group(springs);

  const char* solver = "Solver";
  const std::map<std::string, std::uint32_t> solvers{{"massSpring", CS_SOLVER_MASS_SPRING},
                                                     {"constraint", CS_SOLVER_CONSTRAINT},
                                                     {"acad", CS_SOLVER_ACAD},
                                                     {"xpbd", CS_SOLVER_XPBD},
                                                     {"implicitEuler", CS_SOLVER_IMPLICIT_EULER}};
  app.add_option("--solver", settings.solver, "massSpring, constraint, acad, xpbd or implicitEuler")
      ->transform(CLI::CheckedTransformer(solvers, CLI::ignore_case))
      ->group(solver);
  app.add_option("--iterations", settings.iterations, "Of a solve, at most")
      ->check(CLI::PositiveNumber)
      ->group(solver);
  app.add_option("--tolerance", settings.tolerance, "Part of the residual that may be left")->group(solver);
  app.add_option("--compliance", settings.compliance, "m/N by which a constraint gives way")->group(solver);
  app.add_option("--activation", settings.activation, "Of acad: stretch at which springs become constraints")
      ->group(solver);
  app.add_option("--bend-constraints", settings.bend_constraints,
                 "Whether bend springs are constraints too: 0, 1")
      ->check(CLI::Range(0, 1))
      ->group(solver);

  app.add_option("--assembled", settings.assembled,
                 "Of constraint: whether it multiplies sparse matrices, for comparison: 0, 1")
      ->check(CLI::Range(0, 1))
      ->group(solver);

  const char* material = "Material";
  app.add_option(
         "--material", options.material,
         "Springs, damping, air, friction, mass and solver of a material by name; options beside it go "
         "before it")
      ->group(material);
  app.add_option("--damping", settings.damping, "Decay of velocities, 1/s")->group(material);
  app.add_option("--drag", settings.drag, "Of the air")->group(material);
  app.add_option("--lift", settings.lift, "Of the air")->group(material);
  app.add_option("--friction", settings.friction, "Against colliders")->group(material);
  app.add_option("--thickness", settings.thickness, "Distance kept from colliders, m")->group(material);

  app.add_option("--ball-radius", settings.ball_radius, "Of a cloth with self-collision, m")->group(material);
  app.add_option("--ball-friction", settings.ball_friction, "Of a cloth with self-collision")
      ->group(material);

  const char* environment = "Environment";
  app.add_option("--gravity", options.gravity, "X,Y,Z in m/s^2")
      ->delimiter(',')
      ->expected(3)
      ->group(environment);
  app.add_option("--wind", options.wind, "X,Y,Z in m/s")->delimiter(',')->expected(3)->group(environment);
  app.add_option("--gust", options.gust, "STRENGTH[,SECONDS]: m/s that the wind strays by, and how fast (2)")
      ->delimiter(',')
      ->expected(1, 2)
      ->group(environment);
  app.add_option("--air-density", options.airDensity, "kg/m^3")->group(environment);
}

}  // namespace clothstream::cli
