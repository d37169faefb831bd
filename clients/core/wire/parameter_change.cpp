// SPDX-License-Identifier: MIT
// Reads, writes and applies parameter changes. The tables of parameters give the fields of the numbers.
#include "clients/core/wire/parameter_change.h"

#include "proto/parameters/apply_change.h"

namespace clothstream::client {
namespace {

using parameters::ClothNumbers;
using parameters::ClothParameter;
using parameters::EnvironmentChange;
using parameters::EnvironmentParameter;
using parameters::EnvironmentValue;
using parameters::EnvironmentValues;
using parameters::Group;
using parameters::kClothParameters;
using parameters::kEnvironmentParameters;
using parameters::WireField;
using Writer = protozero::pbf_writer;

constexpr std::size_t kMaxSolvers = 32;  // remembered solver kinds per cloth

// Message that a field number belongs to: that of the scene, or that of the change.
using In = std::uint32_t WireField::*;

bool readGroup(Bytes message, const Group& group, In in, ClothNumbers& numbers) {
  if (group.isReplaced)
    for (const ClothParameter& parameter : kClothParameters)
      if (parameter.group == &group) numbers[parameter.number] = 0;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    for (const ClothParameter& parameter : kClothParameters)
      if (parameter.group == &group && tag == fixed32(parameter.field.*in))
        return setFinite(numbers[parameter.number], reader);
    return skip(reader);
  });
}

// Skips a field that the table does not list.
bool readNumber(std::uint32_t tag, Reader& reader, In in, ClothNumbers& numbers) {
  for (const ClothParameter& parameter : kClothParameters) {
    if (parameter.group == nullptr && tag == fixed32(parameter.field.*in))
      return setFinite(numbers[parameter.number], reader);
    if (parameter.group != nullptr && tag == bytes(parameter.group->field.*in))
      return readGroup(reader.get_view(), *parameter.group, in, numbers);
  }
  return skip(reader);
}

// The message is a Vec3 or a Gust.
bool readValue(Bytes message, const EnvironmentParameter& parameter, EnvironmentValue& value) {
  value = emptyValue(parameter);
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i)
      if (tag == fixed32(i + 1)) return setFinite(value[i], reader);
    return skip(reader);
  });
}

// Skips a field that the table does not list.
bool readNumber(std::uint32_t tag, Reader& reader, In in, EnvironmentChange& change) {
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    const std::uint32_t number = parameter.field.*in;
    if (tag != (parameter.isMessage() ? bytes(number) : fixed32(number))) continue;
    EnvironmentValue& value = change[parameter.row].emplace();
    if (!parameter.isMessage()) return setFinite(value[0], reader);
    if (!parameter.isVector || in == &WireField::inScene)
      return readValue(reader.get_view(), parameter, value);
    return readFields(reader.get_view(), [&](std::uint32_t inner, Reader& wrapper) {
      return inner == field::Vec3Value::kValue.tag ? readValue(wrapper.get_view(), parameter, value)
                                                   : skip(wrapper);
    });
  }
  return skip(reader);
}

bool readConstraintSolver(Bytes message, Solver& solver) {
  using F = field::ConstraintSolver;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kBendConstraints.tag:
        return set(solver.bendConstraints, reader.get_bool());
      case F::kCompliance.tag:
        return setFinite(solver.compliance, reader);
      case F::kIterations.tag:
        return set(solver.iterations, reader.get_uint32());
      case F::kTolerance.tag:
        return setFinite(solver.tolerance, reader);
      case F::kPath.tag:
        return solver.path = reader.get_uint32(), true;
      default:
        return skip(reader);
    }
  });
}

bool readAcadSolver(Bytes message, Solver& solver) {
  using F = field::AcadSolver;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kActivation.tag) return setFinite(solver.activation, reader);
    if (tag == F::kMode.tag) return solver.acadMode = reader.get_uint32(), true;
    return tag == F::kConstraint.tag ? readConstraintSolver(reader.get_view(), solver) : skip(reader);
  });
}

bool readXpbdSolver(Bytes message, Solver& solver) {
  using F = field::XpbdSolver;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kIterations.tag) return set(solver.iterations, reader.get_uint32());
    return tag == F::kCompliance.tag ? setFinite(solver.compliance, reader) : skip(reader);
  });
}

bool readImplicitEulerSolver(Bytes message, Solver& solver) {
  using F = field::ImplicitEulerSolver;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kIterations.tag) return set(solver.iterations, reader.get_uint32());
    return tag == F::kTolerance.tag ? setFinite(solver.tolerance, reader) : skip(reader);
  });
}

bool readClothChange(Bytes message, ClothChange& change) {
  using F = field::ClothChange;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kName.tag:
        return setText(change.name, reader);
      case F::kSolver.tag:
        return readSolver(reader.get_view(), change.solver.emplace());
      case F::kMaterial.tag:
        return setText(change.material.emplace(), reader);
      default:
        return readNumber(tag, reader, &WireField::inChange, change.numbers);
    }
  });
}

void writeEnvironment(Writer& message, const EnvironmentChange& change) {
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    const std::optional<EnvironmentValue>& value = change[parameter.row];
    if (!value) continue;
    if (!parameter.isMessage()) {
      message.add_float(parameter.field.inChange, (*value)[0]);
      continue;
    }
    Writer holder(message, parameter.field.inChange);
    if (parameter.isVector)
      addVec3(holder, field::Vec3Value::kValue, *value);
    else
      for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i) holder.add_float(i + 1, (*value)[i]);
  }
}

std::string constraintMessage(const Solver& solver) {
  std::string settings;
  Writer writer(settings);
  using F = field::ConstraintSolver;
  writer.add_bool(F::kBendConstraints.number, solver.bendConstraints);
  if (solver.compliance) writer.add_float(F::kCompliance.number, *solver.compliance);
  writer.add_uint32(F::kIterations.number, solver.iterations);
  writer.add_float(F::kTolerance.number, solver.tolerance);
  if (solver.kind == CS_SOLVER_CONSTRAINT) writer.add_uint32(F::kPath.number, solver.path);
  return settings;
}

// The settings of a kind that this client does not know are sent back unchanged.
std::string solverMessage(const Solver& solver) {
  std::string settings = solver.settings;
  if (solver.kind == CS_SOLVER_CONSTRAINT) settings = constraintMessage(solver);
  if (solver.kind == CS_SOLVER_ACAD) {
    settings.clear();
    Writer writer(settings);
    writer.add_float(field::AcadSolver::kActivation.number, solver.activation);
    writer.add_message(field::AcadSolver::kConstraint.number, constraintMessage(solver));
    if (solver.acadMode != 0) writer.add_uint32(field::AcadSolver::kMode.number, solver.acadMode);
  }
  if (solver.kind == CS_SOLVER_XPBD) {
    settings.clear();
    Writer writer(settings);
    writer.add_uint32(field::XpbdSolver::kIterations.number, solver.iterations);
    if (solver.compliance) writer.add_float(field::XpbdSolver::kCompliance.number, *solver.compliance);
  }
  if (solver.kind == CS_SOLVER_IMPLICIT_EULER) {
    settings.clear();
    Writer writer(settings);
    writer.add_uint32(field::ImplicitEulerSolver::kIterations.number, solver.iterations);
    writer.add_float(field::ImplicitEulerSolver::kTolerance.number, solver.tolerance);
  }
  std::string message;
  Writer(message).add_message(solver.kind, settings);
  return message;
}

// Writes a group. A group that is replaced is written in full.
void writeGroup(Writer& cloth, const Group& group, const ClothNumbers& numbers) {
  Writer message(cloth, group.field.inChange);
  for (const ClothParameter& parameter : kClothParameters)
    if (parameter.group == &group && (group.isReplaced || numbers.has(parameter.number)))
      message.add_float(parameter.field.inChange, numbers[parameter.number]);
}

void writeCloth(Writer& cloth, const ClothChange& change) {
  using F = field::ClothChange;
  cloth.add_string(F::kName.number, change.name);
  const auto writeSolver = [&] {
    if (change.solver) cloth.add_message(F::kSolver.number, solverMessage(*change.solver));
  };
  // Fields are written in ascending order.
  bool isSolverDue = true;
  const Group* previous = nullptr;
  for (const ClothParameter& parameter : kClothParameters) {
    const Group* group = parameter.group;
    if (isSolverDue && (group != nullptr ? group->field : parameter.field).inChange > F::kSolver.number) {
      writeSolver();
      isSolverDue = false;
    }
    if (group == nullptr && change.numbers.has(parameter.number))
      cloth.add_float(parameter.field.inChange, change.numbers[parameter.number]);
    if (group != nullptr && group != previous && change.numbers.hasAnyOf(*group))
      writeGroup(cloth, *group, change.numbers);
    previous = group;
  }
  if (isSolverDue) writeSolver();
  if (change.material) cloth.add_string(F::kMaterial.number, *change.material);
  if (change.arealMass) cloth.add_float(F::kArealMass.number, *change.arealMass);
}

}  // namespace

bool readParameterChange(Bytes message, ParameterChange& change) {
  using F = field::ParameterChange;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag != F::kCloths.tag) return readNumber(tag, reader, &WireField::inChange, change.environment);
    return change.cloths.size() < kMaxClothChanges &&
           readClothChange(reader.get_view(), change.cloths.emplace_back());
  });
}

bool readEnvironment(Bytes message, EnvironmentValues& environment) {
  EnvironmentChange given;
  const bool isRead = readFields(message, [&](std::uint32_t tag, Reader& reader) {
    return readNumber(tag, reader, &WireField::inScene, given);
  });
  parameters::applyChange(given, environment);
  return isRead;
}

bool readClothParameters(Bytes message, std::string& name, ClothParameters& parameters) {
  using F = field::Cloth;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kName.tag:
        return setText(name, reader);
      case F::kSolver.tag:
        return readSolver(reader.get_view(), parameters.solver);
      case F::kMaterial.tag:
        return setText(parameters.material, reader);
      default:
        return readNumber(tag, reader, &WireField::inScene, parameters.numbers);
    }
  });
}

// Keeps the number and the settings of a kind that this client does not know.
bool readSolver(Bytes message, Solver& out) {
  out = {};
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag % 8 != static_cast<std::uint32_t>(field::WireType::kBytes)) return skip(reader);
    const Bytes settings = reader.get_view();
    out.kind = tag / 8;
    out.settings.assign(settings.data(), settings.size());
    switch (out.kind) {
      case CS_SOLVER_CONSTRAINT:
        return readConstraintSolver(settings, out);
      case CS_SOLVER_ACAD:
        return readAcadSolver(settings, out);
      case CS_SOLVER_XPBD:
        return readXpbdSolver(settings, out);
      case CS_SOLVER_IMPLICIT_EULER:
        return readImplicitEulerSolver(settings, out);
      default:
        return true;
    }
  });
}

void addVec3(Writer& parent, field::Field vec3Field, const Vec3& value) {
  Writer vec3(parent, vec3Field.number);
  vec3.add_float(field::Vec3::kX.number, value[0]);
  vec3.add_float(field::Vec3::kY.number, value[1]);
  vec3.add_float(field::Vec3::kZ.number, value[2]);
}

void writeFields(Writer& message, const ParameterChange& change) {
  using F = field::ParameterChange;
  writeEnvironment(message, change.environment);
  for (const ClothChange& clothChange : change.cloths) {
    Writer cloth(message, F::kCloths.number);
    writeCloth(cloth, clothChange);
  }
}

ClothNumbers ClothParameters::defaultNumbers() {
  ClothNumbers numbers;
  // A description has the pressure of the cloths that can hold gas.
  for (const ClothParameter& parameter : kClothParameters)
    if ((parameter.group == nullptr || parameter.group->isReplaced) &&
        parameter.number != parameters::ClothNumber::pressure)
      numbers[parameter.number] = parameter.initial;
  return numbers;
}

void apply(const ClothChange& change, ClothParameters& cloth) {
  parameters::applyNumbers(change.numbers, [&](parameters::ClothNumber number) {
    const bool lacks = number == parameters::ClothNumber::pressure && !cloth.numbers.has(number);
    return lacks ? nullptr : &cloth.numbers[number];
  });
  parameters::assign(cloth.material, change.material);
  if (!change.solver) return;
  cloth.solver = *change.solver;
  if (cloth.solvers.size() < kMaxSolvers) cloth.solvers[cloth.solver.kind] = cloth.solver;
}

}  // namespace clothstream::client
