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
  using F = field::Vec3Value;
  Vec3& value = target.emplace();
  return readFields(reader.get_view(), [&](std::uint32_t tag, Reader& wrapped) {
    return tag == F::kValue.tag ? readVec3(wrapped.get_view(), value) : skip(wrapped);
  });
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
      case F::kStructural.tag:
        return setSpring(change.structural, reader);
      case F::kShear.tag:
        return setSpring(change.shear, reader);
      case F::kBend.tag:
        return setSpring(change.bend, reader);
      case F::kDamping.tag:
        return setFinite(change.damping, reader);
      case F::kDrag.tag:
        return setFinite(change.drag, reader);
      case F::kLift.tag:
        return setFinite(change.lift, reader);
      case F::kFriction.tag:
        return setFinite(change.friction, reader);
      case F::kThickness.tag:
        return setFinite(change.thickness, reader);
      case F::kSolver.tag:
        return readSolver(reader.get_view(), change.solver.emplace());
      case F::kSelfCollision.tag:
        return readSelfCollision(reader.get_view(), change.ballRadius, change.ballFriction);
      case F::kTethers.tag:
        return readTethers(reader.get_view(), change.tetherSlack);
      case F::kDihedralBending.tag:
        return setFinite(change.dihedralBending, reader);
      case F::kMaterial.tag:
        return setText(change.material.emplace(), reader);
      default:
        return skip(reader);
    }
  });
}

}  // namespace

bool readParameterChange(Bytes message, ParameterChange& change) {
  using F = field::ParameterChange;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kGravity.tag:
        return setVec3Value(change.gravity, reader);
      case F::kWind.tag:
        return setVec3Value(change.wind, reader);
      case F::kAirDensity.tag:
        return setFinite(change.airDensity, reader);
      case F::kCloths.tag:
        return change.cloths.size() < kMaxCloths &&
               readClothChange(reader.get_view(), change.cloths.emplace_back());
      case F::kGust.tag:
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
  using F = field::Gust;
  out = {};
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kStrength.tag) return setFinite(out.strength, reader);
    return tag == F::kSeconds.tag ? setFinite(out.seconds, reader) : skip(reader);
  });
}

bool readSelfCollision(Bytes message, std::optional<float>& radius, std::optional<float>& friction) {
  using F = field::SelfCollision;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kRadius.tag) return setFinite(radius, reader);
    return tag == F::kFriction.tag ? setFinite(friction, reader) : skip(reader);
  });
}

bool readTethers(Bytes message, std::optional<float>& slack) {
  using F = field::Tethers;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    return tag == F::kSlack.tag ? setFinite(slack, reader) : skip(reader);
  });
}

// A kind that this client does not know keeps its number and its settings.
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

}  // namespace clothstream::client
