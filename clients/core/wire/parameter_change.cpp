// SPDX-License-Identifier: MIT
// Field by field through a ParameterChange, its cloths and their solvers.
#include "clients/core/wire/parameter_change.h"

namespace clothstream::client {
namespace {

bool setSpring(std::optional<Spring>& target, Reader& reader) {
  return readSpring(reader.get_view(), target.emplace());
}

// Vec3Value { Vec3 value = 1; }
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
      case bytes(2):
        return setSpring(change.structural, reader);
      case bytes(3):
        return setSpring(change.shear, reader);
      case bytes(4):
        return setSpring(change.bend, reader);
      case fixed32(5):
        return setFinite(change.damping, reader);
      case fixed32(6):
        return setFinite(change.drag, reader);
      case fixed32(7):
        return setFinite(change.lift, reader);
      case fixed32(8):
        return setFinite(change.friction, reader);
      case fixed32(9):
        return setFinite(change.thickness, reader);
      case bytes(20):
        return readSolver(reader.get_view(), change.solver.emplace());
      case bytes(21):
        return readSelfCollision(reader.get_view(), change.ballRadius, change.ballFriction);
      case bytes(23):
        return readTethers(reader.get_view(), change.tetherSlack);
      case fixed32(24):
        return setFinite(change.dihedralBending, reader);
      case bytes(40):
        return setText(change.material.emplace(), reader);
      default:
        return skip(reader);
    }
  });
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

bool readSpring(Bytes message, Spring& out) {
  return readFloats(message, out);
}

bool readGust(Bytes message, Gust& out) {
  out = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed32(1)) return setFinite(out.strength, reader);
    return field == fixed32(2) ? setFinite(out.seconds, reader) : skip(reader);
  });
}

bool readSelfCollision(Bytes message, std::optional<float>& radius, std::optional<float>& friction) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed32(1)) return setFinite(radius, reader);
    return field == fixed32(2) ? setFinite(friction, reader) : skip(reader);
  });
}

bool readTethers(Bytes message, std::optional<float>& slack) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    return field == fixed32(1) ? setFinite(slack, reader) : skip(reader);
  });
}

// A kind that this client does not know keeps its number and its settings.
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

}  // namespace clothstream::client
