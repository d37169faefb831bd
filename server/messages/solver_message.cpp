// SPDX-License-Identifier: MIT
#include "server/messages/solver_message.h"

#include <fmt/format.h>

namespace clothstream::messages {
namespace {

using parameters::kIterations;
using parameters::kXpbdIterations;

// Reads the fields that all iterative solvers with a tolerance have.
template <typename Message>
void readIterations(Checks& checks, const Path& path, const Message& message, model::Solver& solver) {
  if (message.has_iterations())
    solver.iterations =
        checks.integer(path / "iterations", message.iterations(), kIterations.min, kIterations.max);
  if (message.has_tolerance())
    solver.tolerance = checks.number(path / "tolerance", message.tolerance(), parameters::kTolerance.range);
}

void readConstraint(Checks& checks, const Path& path, const v1::ConstraintSolver& message,
                    model::Solver& solver) {
  solver.bendConstraints = message.bend_constraints();
  if (message.has_compliance())
    solver.compliance =
        checks.number(path / "compliance", message.compliance(), parameters::kCompliance.range);
  readIterations(checks, path, message, solver);
  switch (message.path()) {
    case v1::CONSTRAINT_PATH_UNSPECIFIED:
    case v1::CONSTRAINT_PATH_MATRIX_FREE:
      break;
    case v1::CONSTRAINT_PATH_ASSEMBLED:
      solver.path = model::ConstraintPath::assembled;
      if (solver.kind == model::SolverKind::acad)
        checks.fail(path / "path", "CONSTRAINT_PATH_ASSEMBLED",
                    "must be CONSTRAINT_PATH_MATRIX_FREE for acad, whose constraints change every substep");
      break;
    default:
      checks.fail(path / "path", fmt::format("{}", static_cast<int>(message.path())),
                  "must be CONSTRAINT_PATH_MATRIX_FREE or CONSTRAINT_PATH_ASSEMBLED");
  }
}

void writeConstraint(const model::Solver& solver, v1::ConstraintSolver& message) {
  message.set_bend_constraints(solver.bendConstraints);
  if (solver.compliance) message.set_compliance(*solver.compliance);
  message.set_iterations(solver.iterations);
  message.set_tolerance(solver.tolerance);
  message.set_path(solver.path == model::ConstraintPath::assembled ? v1::CONSTRAINT_PATH_ASSEMBLED
                                                                   : v1::CONSTRAINT_PATH_MATRIX_FREE);
}

void readMode(Checks& checks, const Path& path, v1::AcadMode mode, model::Solver& solver) {
  switch (mode) {
    case v1::ACAD_MODE_UNSPECIFIED:
    case v1::ACAD_MODE_LIMIT:
      break;
    case v1::ACAD_MODE_PAPER:
      solver.acadMode = model::AcadMode::paper;
      break;
    default:
      checks.fail(path, fmt::format("{}", static_cast<int>(mode)),
                  "must be ACAD_MODE_LIMIT or ACAD_MODE_PAPER");
  }
}

}  // namespace

model::Solver toSolver(Checks& checks, const Path& path, const v1::Solver& message) {
  model::Solver solver;
  if (message.has_constraint()) {
    solver.kind = model::SolverKind::constraint;
    readConstraint(checks, path / "constraint", message.constraint(), solver);
  } else if (message.has_acad()) {
    const v1::AcadSolver& acad = message.acad();
    const Path at = path / "acad";
    solver.kind = model::SolverKind::acad;
    if (acad.has_activation())
      solver.activation = checks.number(at / "activation", acad.activation(), parameters::kActivation.range);
    readConstraint(checks, at / "constraint", acad.constraint(), solver);
    readMode(checks, at / "mode", acad.mode(), solver);
  } else if (message.has_xpbd()) {
    const v1::XpbdSolver& xpbd = message.xpbd();
    const Path at = path / "xpbd";
    solver.kind = model::SolverKind::xpbd;
    solver.iterations = kXpbdIterations.initial;
    if (xpbd.has_iterations())
      solver.iterations =
          checks.integer(at / "iterations", xpbd.iterations(), kXpbdIterations.min, kXpbdIterations.max);
    if (xpbd.has_compliance())
      solver.compliance = checks.number(at / "compliance", xpbd.compliance(), parameters::kCompliance.range);
  } else if (message.has_implicit_euler()) {
    solver.kind = model::SolverKind::implicitEuler;
    readIterations(checks, path / "implicitEuler", message.implicit_euler(), solver);
  }
  return solver;
}

v1::Solver toMessage(const model::Solver& solver) {
  v1::Solver message;
  switch (solver.kind) {
    case model::SolverKind::massSpring:
      message.mutable_mass_spring();
      break;
    case model::SolverKind::constraint:
      writeConstraint(solver, *message.mutable_constraint());
      break;
    case model::SolverKind::acad:
      message.mutable_acad()->set_activation(solver.activation);
      message.mutable_acad()->set_mode(solver.acadMode == model::AcadMode::paper ? v1::ACAD_MODE_PAPER
                                                                                 : v1::ACAD_MODE_LIMIT);
      writeConstraint(solver, *message.mutable_acad()->mutable_constraint());
      break;
    case model::SolverKind::xpbd:
      message.mutable_xpbd()->set_iterations(solver.iterations);
      if (solver.compliance) message.mutable_xpbd()->set_compliance(*solver.compliance);
      break;
    case model::SolverKind::implicitEuler:
      message.mutable_implicit_euler()->set_iterations(solver.iterations);
      message.mutable_implicit_euler()->set_tolerance(solver.tolerance);
      break;
  }
  return message;
}

}  // namespace clothstream::messages
