// SPDX-License-Identifier: MIT
// Reads, writes and applies parameter changes. The table of parameters gives the fields of a cloth's numbers.
#include "clients/core/parameter_change.h"

namespace clothstream::client {
namespace {

using parameters::ClothNumbers;
using parameters::ClothParameter;
using parameters::Group;
using parameters::kClothParameters;
using parameters::WireField;
using Writer = protozero::pbf_writer;

constexpr std::size_t kMaxSolvers = 32;  // remembered solver kinds per cloth
constexpr std::uint32_t kSolverInChange = 20;

// Message that a field number belongs to: Cloth or ClothChange.
using In = std::uint32_t WireField::*;

bool readGroup(Bytes message, const Group& group, In in, ClothNumbers& numbers) {
  if (group.isReplaced)
    for (const ClothParameter& parameter : kClothParameters)
      if (parameter.group == &group) numbers[parameter.number] = 0;
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    for (const ClothParameter& parameter : kClothParameters)
      if (parameter.group == &group && field == fixed32(parameter.field.*in))
        return setFinite(numbers[parameter.number], reader);
    return skip(reader);
  });
}

// Skips a field that the table does not list.
bool readNumber(std::uint32_t field, Reader& reader, In in, ClothNumbers& numbers) {
  for (const ClothParameter& parameter : kClothParameters) {
    if (parameter.group == nullptr && field == fixed32(parameter.field.*in))
      return setFinite(numbers[parameter.number], reader);
    if (parameter.group != nullptr && field == bytes(parameter.group->field.*in))
      return readGroup(reader.get_view(), *parameter.group, in, numbers);
  }
  return skip(reader);
}

// The message is Vec3Value { Vec3 value = 1; }.
bool setVec3Value(std::optional<Vec3>& target, Reader& reader) {
  Vec3& value = target.emplace();
  return readFields(reader.get_view(), [&](std::uint32_t field, Reader& wrapped) {
    return field == bytes(1) ? readVec3(wrapped.get_view(), value) : skip(wrapped);
  });
}

bool readConstraintSolver(Bytes message, Solver& solver) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(solver.bendConstraints, reader.get_bool());
      case fixed32(2):
        return setFinite(solver.compliance, reader);
      case varint(3):
        return set(solver.iterations, reader.get_uint32());
      case fixed32(4):
        return setFinite(solver.tolerance, reader);
      case varint(5):
        return solver.path = reader.get_uint32(), true;
      default:
        return skip(reader);
    }
  });
}

bool readAcadSolver(Bytes message, Solver& solver) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed32(1)) return setFinite(solver.activation, reader);
    return field == bytes(2) ? readConstraintSolver(reader.get_view(), solver) : skip(reader);
  });
}

bool readXpbdSolver(Bytes message, Solver& solver) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == varint(1)) return set(solver.iterations, reader.get_uint32());
    return field == fixed32(2) ? setFinite(solver.compliance, reader) : skip(reader);
  });
}

bool readImplicitEulerSolver(Bytes message, Solver& solver) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == varint(1)) return set(solver.iterations, reader.get_uint32());
    return field == fixed32(2) ? setFinite(solver.tolerance, reader) : skip(reader);
  });
}

bool readClothChange(Bytes message, ClothChange& change) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setText(change.name, reader);
      case bytes(kSolverInChange):
        return readSolver(reader.get_view(), change.solver.emplace());
      case bytes(40):
        return setText(change.material.emplace(), reader);
      default:
        return readNumber(field, reader, &WireField::inChange, change.numbers);
    }
  });
}

void addVec3Value(Writer& parent, std::uint32_t field, const std::optional<Vec3>& value) {
  if (!value) return;
  Writer wrapper(parent, field);
  Writer vec3(wrapper, 1);
  for (std::uint32_t i = 0; i < 3; ++i) vec3.add_float(i + 1, (*value)[i]);
}

std::string constraintMessage(const Solver& solver) {
  std::string settings;
  Writer writer(settings);
  writer.add_bool(1, solver.bendConstraints);
  if (solver.compliance) writer.add_float(2, *solver.compliance);
  writer.add_uint32(3, solver.iterations);
  writer.add_float(4, solver.tolerance);
  if (solver.kind == CS_SOLVER_CONSTRAINT) writer.add_uint32(5, solver.path);
  return settings;
}

// The settings of a kind that this client does not know are sent back as received.
std::string solverMessage(const Solver& solver) {
  std::string settings = solver.settings;
  if (solver.kind == CS_SOLVER_CONSTRAINT) settings = constraintMessage(solver);
  if (solver.kind == CS_SOLVER_ACAD) {
    settings.clear();
    Writer writer(settings);
    writer.add_float(1, solver.activation);
    writer.add_message(2, constraintMessage(solver));
  }
  if (solver.kind == CS_SOLVER_XPBD) {
    settings.clear();
    Writer writer(settings);
    writer.add_uint32(1, solver.iterations);
    if (solver.compliance) writer.add_float(2, *solver.compliance);
  }
  if (solver.kind == CS_SOLVER_IMPLICIT_EULER) {
    settings.clear();
    Writer writer(settings);
    writer.add_uint32(1, solver.iterations);
    writer.add_float(2, solver.tolerance);
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
  cloth.add_string(1, change.name);
  const auto writeSolver = [&] {
    if (change.solver) cloth.add_message(kSolverInChange, solverMessage(*change.solver));
  };
  // Fields are written in ascending order.
  bool isSolverDue = true;
  const Group* previous = nullptr;
  for (const ClothParameter& parameter : kClothParameters) {
    const Group* group = parameter.group;
    if (isSolverDue && (group != nullptr ? group->field : parameter.field).inChange > kSolverInChange) {
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
  if (change.material) cloth.add_string(40, *change.material);
}

}  // namespace

bool readParameterChange(Bytes message, ParameterChange& change) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setVec3Value(change.gravity, reader);
      case bytes(2):
        return setVec3Value(change.wind, reader);
      case fixed32(3):
        return setFinite(change.airDensity, reader);
      case bytes(4):
        return change.cloths.size() < kMaxCloths &&
               readClothChange(reader.get_view(), change.cloths.emplace_back());
      case bytes(40):
        return readGust(reader.get_view(), change.gust.emplace());
      default:
        return skip(reader);
    }
  });
}

bool readGust(Bytes message, Gust& out) {
  out = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed32(1)) return setFinite(out.strength, reader);
    return field == fixed32(2) ? setFinite(out.seconds, reader) : skip(reader);
  });
}

bool readClothParameters(Bytes message, std::string& name, ClothParameters& parameters) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setText(name, reader);
      case bytes(20):
        return readSolver(reader.get_view(), parameters.solver);
      case bytes(40):
        return setText(parameters.material, reader);
      default:
        return readNumber(field, reader, &WireField::inCloth, parameters.numbers);
    }
  });
}

// Keeps the number and the settings of a kind that this client does not know.
bool readSolver(Bytes message, Solver& out) {
  out = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field % 8 != bytes(0) % 8) return skip(reader);
    const Bytes settings = reader.get_view();
    out.kind = field / 8;
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

void writeFields(Writer& message, const ParameterChange& change) {
  addVec3Value(message, 1, change.gravity);
  addVec3Value(message, 2, change.wind);
  if (change.airDensity) message.add_float(3, *change.airDensity);
  if (change.gust) {
    Writer gust(message, 40);
    gust.add_float(1, change.gust->strength);
    gust.add_float(2, change.gust->seconds);
  }
  for (const ClothChange& clothChange : change.cloths) {
    Writer cloth(message, 4);
    writeCloth(cloth, clothChange);
  }
}

ClothNumbers ClothParameters::defaultNumbers() {
  ClothNumbers numbers;
  for (const ClothParameter& parameter : kClothParameters)
    if (parameter.group == nullptr || parameter.group->isReplaced)
      numbers[parameter.number] = parameter.initial;
  return numbers;
}

void apply(const ClothChange& change, ClothParameters& cloth) {
  parameters::applyNumbers(change.numbers,
                           [&](parameters::ClothNumber number) { return &cloth.numbers[number]; });
  cloth.material = change.material.value_or(cloth.material);
  if (!change.solver) return;
  cloth.solver = *change.solver;
  if (cloth.solvers.size() < kMaxSolvers) cloth.solvers[cloth.solver.kind] = cloth.solver;
}

}  // namespace clothstream::client
