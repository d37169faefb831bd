// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/hull_target.h"

#include <cmath>
#include <memory>

#include "inputs.pb.h"
#include "server/messages/shapes.h"
#include "server/model/collider.h"

namespace clothstream::fuzz {
namespace {

void run(const HullInput& input) {
  v1::Collider collider;
  *collider.mutable_hull() = input.hull();
  messages::Checks checks;
  const model::Shape shape = messages::toShape(checks, messages::Path("collider"), collider);
  if (checks.failed()) return;
  const auto& hull = *std::get<std::shared_ptr<const model::ConvexHull>>(shape);
  float size = 0;
  for (const model::Vec3& vertex : hull.vertices) size = std::max(size, vertex.cwiseAbs().maxCoeff());
  // Corners may be in front of a face by this fraction of the hull's size, which is at most its diagonal.
  const double tolerance = 4 * model::kHullTolerance * double{size};
  for (const model::HalfSpace& plane : hull.planes) {
    require(plane.normal.allFinite() && std::isfinite(plane.offset), "planes are finite");
    require(std::abs(plane.normal.norm() - 1) < 1e-4f, "normals have length 1");
    for (const model::Vec3& vertex : hull.vertices)
      require(double{plane.normal.dot(vertex)} - double{plane.offset} <= tolerance,
              "corners lie inside the planes");
  }
  for (const auto& face : hull.faces)
    for (const std::uint32_t corner : face)
      require(corner < hull.vertices.size(), "faces name existing corners");
  v1::Collider written;
  messages::writeHull(hull, *written.mutable_hull());
  messages::Checks again;
  static_cast<void>(messages::toShape(again, messages::Path("collider"), written));
  require(!again.failed(), "an accepted hull is accepted again");
}

}  // namespace

const Target kHullTarget{
    .name = "hull", .run = &runStructured<HullInput, &run>, .structure = &HullInput::default_instance()};

}  // namespace clothstream::fuzz
