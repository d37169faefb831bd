// SPDX-License-Identifier: MIT
// Contact by the height above a convex surface, which is a convex function along a straight path.
#include "server/reference/contact.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "server/reference/solid.h"

namespace clothstream::reference {
namespace {

// Height above the nearest part of a shape's surface, including thickness; negative inside.
struct Surface {
  double height;
  Vec3 normal;
};

// Over the balls about the points of a segment along Y. The radius of the first one, at -Y, changes by
// `slope` along the segment.
Surface overRound(const Vec3& p, double radius, double length, double slope) {
  const double nearest = p.y() + slope / std::sqrt(1 - slope * slope) * std::hypot(p.x(), p.z());
  const double y = std::clamp(nearest, -length / 2, length / 2);
  const Vec3 offset = p - Vec3(0, y, 0);
  const double distance = offset.norm();
  return {distance - radius - slope * (y + length / 2),
          distance > 1e-12 ? Vec3(offset / distance) : Vec3::UnitY()};
}

void raise(Surface& surface, const Vec3& normal, double height) {
  if (height > surface.height) surface = {height, normal};
}

Surface overBox(const Vec3& p, const Vec3& size, double thickness) {
  Surface surface{-INFINITY, Vec3::UnitY()};
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0})
      raise(surface, side * Vec3::Unit(axis), side * p[axis] - size[axis] / 2 - thickness);
  return surface;
}

Surface overHull(const Vec3& p, const model::ConvexHull& hull, double thickness) {
  Surface surface{-INFINITY, Vec3::UnitY()};
  for (const model::HalfSpace& plane : hull.planes) {
    const Vec3 normal = plane.normal.cast<double>();
    raise(surface, normal, normal.dot(p) - plane.offset - thickness);
  }
  return surface;
}

Surface over(const model::Shape& shape, double thickness, const Vec3& p) {
  return std::visit(
      model::ShapeVisitor{
          [&](const model::Sphere& sphere) { return overRound(p, sphere.radius + thickness, 0, 0); },
          [&](const model::Capsule& capsule) {
            return overRound(p, capsule.radius + thickness, capsule.length, double{model::slopeOf(capsule)});
          },
          [&](const model::Plane&) {
            return Surface{p.y() - thickness, Vec3::UnitY()};
          },
          [&](const model::Box& box) { return overBox(p, box.size.cast<double>(), thickness); },
          [&](const model::Hull& hull) { return overHull(p, *hull, thickness); },
          [](const model::Solid&) -> Surface { throw std::logic_error("a mesh is not convex"); }},
      shape);
}

bool isRound(const model::Shape& shape) {
  return std::visit(model::ShapeVisitor{
                        [](const model::Sphere&) { return true; }, [](const model::Capsule&) { return true; },
                        [](const model::Plane&) { return false; }, [](const model::Box&) { return false; },
                        [](const model::Hull&) { return false; }, [](const model::Solid&) { return false; }},
                    shape);
}

// First point between `from`, which is outside, and `to` with height zero.
std::optional<Vec3> entry(const model::Shape& shape, double thickness, const Vec3& from, const Vec3& to) {
  const auto height = [&](double t) { return over(shape, thickness, from + t * (to - from)).height; };
  // Ternary search for the lowest point.
  double low = 0, high = 1;
  if (height(1) >= 0)
    for (int i = 0; i < 80; ++i) {
      const double a = low + (high - low) / 3, b = high - (high - low) / 3;
      (height(a) < height(b) ? high : low) = height(a) < height(b) ? b : a;
    }
  const double lowest = height(1) < 0 ? 1 : (low + high) / 2;
  if (height(lowest) >= 0) return std::nullopt;
  double outside = 0, inside = lowest;
  for (int i = 0; i < 60; ++i) {
    const double middle = (outside + inside) / 2;
    (height(middle) > 0 ? outside : inside) = middle;
  }
  return from + inside * (to - from);
}

// Normals of a mesh whose product is above this are on one side.
constexpr double kSameSide = 0.01;

// On the triangles of a mesh, or in its grid of distances.
NearestPoint nearestPoint(const model::ClosedMesh& mesh, const Vec3& p) {
  return mesh.distanceCell > 0 ? nearestInGrid(mesh, p) : nearestOn(mesh, p);
}

// A mesh in a substep.
struct MovingMesh {
  const model::ClosedMesh& before;
  const model::ClosedMesh& after;

  bool moves() const { return &before != &after; }
  // Farthest move of a vertex.
  double farthest() const {
    double most = 0;
    for (std::size_t i = 0; i < before.vertices.size() && moves(); ++i)
      most = std::max(most, double{(after.vertices[i] - before.vertices[i]).norm()});
    return most;
  }
  Vec3 moveAt(const NearestPoint& nearest) const {
    Vec3 move = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = before.triangles[nearest.triangle][k];
      move += nearest.weights[k] * (after.vertices[vertex] - before.vertices[vertex]).cast<double>();
    }
    return move;
  }
};

// Where a path that begins outside first enters: the surface's place at the end of the substep, its normal
// and its move in the substep.
struct Entry {
  Vec3 place, normal, move;
};

std::optional<Entry> entryOf(const MovingMesh& mesh, const Vec3& from, const Vec3& to) {
  if (!mesh.moves() && mesh.before.distanceCell == 0) {
    const std::optional<Crossing> crossing = firstCrossing(mesh.before, from, to);
    if (!crossing) return std::nullopt;
    return Entry{from + crossing->part * (to - from), crossing->normal, Vec3::Zero()};
  }
  constexpr int kSamples = 64;
  NearestPoint outside = nearestPoint(mesh.before, from);
  double part = 0;
  for (int i = 1; i <= kSamples; ++i) {
    const double next = static_cast<double>(i) / kSamples;
    const NearestPoint here = nearestPoint(between(mesh.before, mesh.after, next), from + next * (to - from));
    if (here.distance < 0)
      return Entry{outside.point + (1 - part) * mesh.moveAt(outside), outside.normal, mesh.moveAt(outside)};
    outside = here;
    part = next;
  }
  return std::nullopt;
}

// A path that crosses the surface, or begins inside, stays on the side of its beginning. Other paths end
// outside of the thickness.
std::optional<Contact> contactWithSolid(const MovingMesh& mesh, double thickness, double seconds,
                                        const Vec3& from, const Vec3& to) {
  const double way = (to - from).norm() + mesh.farthest();
  const NearestPoint begin = nearestPoint(mesh.before, from), end = nearestPoint(mesh.after, to);
  const double bound = way + std::max(thickness, double{model::kSolidDepth});
  if (std::abs(begin.distance) >= bound || begin.distance - way >= thickness) return std::nullopt;
  const bool begunInside = begin.distance < 0;
  const Contact atEnd{end.normal, thickness - end.distance, mesh.moveAt(end) / seconds};
  std::optional<Entry> entry;
  if (begunInside) {
    entry = Entry{begin.point + mesh.moveAt(begin), begin.normal, mesh.moveAt(begin)};
  } else if (end.distance < 0 || begin.distance + end.distance < way) {
    entry = entryOf(mesh, from, to);
  }
  if (!entry) return atEnd.depth > 0 ? std::optional(atEnd) : std::nullopt;
  if (std::abs(end.distance) < bound && end.normal.dot(entry->normal) > kSameSide) {
    if (atEnd.depth > 0) return atEnd;
    if (begunInside) return std::nullopt;
  }
  const double depth = thickness - entry->normal.dot(to - entry->place);
  return depth > 0 ? std::optional(Contact{entry->normal, depth, entry->move / seconds}) : std::nullopt;
}

// Both points are in the shape's frame.
std::optional<Contact> contactOf(const model::Shape& shape, double thickness, const Vec3& from,
                                 const Vec3& to) {
  const bool begunInside = over(shape, thickness, from).height <= 0;
  const std::optional<Vec3> entered = begunInside ? from : entry(shape, thickness, from, to);
  if (!entered) return std::nullopt;
  const Surface there = over(shape, thickness, *entered);
  // Round shapes push along their own normal if it is on the side that the path came from.
  if (isRound(shape)) {
    const Surface end = over(shape, thickness, to);
    if (end.normal.dot(there.normal) > 0) {
      if (end.height < 0) return Contact{end.normal, -end.height};
      if (begunInside) return std::nullopt;
    }
  }
  const Vec3 touched = *entered - there.height * there.normal;
  const double depth = (touched - to).dot(there.normal);
  if (depth <= 0) return std::nullopt;
  return Contact{there.normal, depth};
}

}  // namespace

double heightOver(const model::Shape& shape, const Pose& pose, const Vec3& point) {
  if (const auto* solid = std::get_if<model::Solid>(&shape))
    return nearestPoint(**solid, pose.orientation.conjugate() * (point - pose.position)).distance;
  return over(shape, 0, pose.orientation.conjugate() * (point - pose.position)).height;
}

Pose between(const Pose& from, const Pose& to, double part) {
  const double sign = from.orientation.dot(to.orientation) < 0 ? -1 : 1;
  Quaternion mean(from.orientation.coeffs() * (1 - part) + to.orientation.coeffs() * (sign * part));
  mean.normalize();
  return {from.position + part * (to.position - from.position), mean};
}

ColliderStep stepOf(const Pose& start, const Pose& end, std::uint32_t index, std::uint32_t substeps,
                    double tickSeconds) {
  ColliderStep step;
  step.before = between(start, end, static_cast<double>(index) / substeps);
  step.after = between(start, end, (index + 1.0) / substeps);
  step.velocity = (end.position - start.position) / tickSeconds;
  step.seconds = tickSeconds / substeps;
  const Quaternion turn = step.after.orientation * step.before.orientation.conjugate();
  step.spin = 2 * substeps / tickSeconds * turn.vec();
  return step;
}

std::optional<Contact> contactOf(const model::Shape& shape, double thickness, const ColliderStep& step,
                                 const Vec3& from, const Vec3& to) {
  const Vec3 after = to - step.after.position, before = from - step.before.position;
  const Vec3 start = step.before.orientation.conjugate() * before,
             end = step.after.orientation.conjugate() * after;
  std::optional<Contact> contact;
  if (const auto* solid = std::get_if<model::Solid>(&shape)) {
    const MovingMesh mesh =
        step.meshBefore ? MovingMesh{*step.meshBefore, *step.meshAfter} : MovingMesh{**solid, **solid};
    contact = contactWithSolid(mesh, thickness, step.seconds, start, end);
  } else {
    const double reach = model::reachOf(shape) + 2 * thickness;
    if (after.norm() > reach + (after - before).norm()) return std::nullopt;
    contact = contactOf(shape, thickness, start, end);
  }
  if (!contact) return std::nullopt;
  contact->normal = step.after.orientation * contact->normal;
  contact->velocity = step.after.orientation * contact->velocity;
  return contact;
}

}  // namespace clothstream::reference
