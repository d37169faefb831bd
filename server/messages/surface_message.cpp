// SPDX-License-Identifier: MIT
#include "server/messages/surface_message.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {

Result<SurfaceUpdate> toSurfaceUpdate(const v1::SurfaceUpdate& message) {
  Checks checks;
  const Path path("surface");
  SurfaceUpdate update{.id = message.id(), .remove = message.remove()};
  if (message.has_pose()) update.pose = toPose(checks, path / "pose", message.pose());
  const bool removes = message.remove() || message.has_keep();
  if (removes && (message.has_pose() || message.has_part()))
    checks.fail(path / (message.remove() ? "remove" : "keep"), message.remove() ? "true" : "",
                "must be absent in a message with a pose or a part");
  if (message.remove() && message.has_keep())
    checks.fail(path / "keep", "", "must be absent in a message with remove = true");
  if (!removes && !message.has_pose() && !message.has_part())
    checks.fail(path, "", "must have a part, a pose, remove = true, or keep");
  if (message.has_keep()) {
    const auto& ids = message.keep().ids();
    checks.count(path / "keep", static_cast<std::size_t>(ids.size()), 0, limits::kMaxKeptSurfaces);
    if (!checks.failed()) std::ranges::sort(update.keep.emplace(ids.begin(), ids.end()));
  }
  if (message.has_part()) {
    const v1::SurfacePart& from = message.part();
    const Path at = path / "part";
    SurfacePart part{.twoSided = from.two_sided()};
    part.count = checks.integer(at / "count", from.count(), 1, limits::kMaxSurfaceParts);
    if (!checks.failed()) part.index = checks.integer(at / "index", from.index(), 0, part.count - 1);
    if (from.has_friction())
      part.friction = checks.number(at / "friction", from.friction(), limits::kFriction);
    if (from.positions_size() % 3 != 0)
      checks.fail(at / "positions", fmt::format("{} numbers", from.positions_size()),
                  "must have three numbers for each vertex");
    if (from.triangles_size() % 3 != 0)
      checks.fail(at / "triangles", fmt::format("{} numbers", from.triangles_size()),
                  "must have three numbers for each triangle");
    if (message.has_pose() && part.index > 0)
      checks.fail(path / "pose", "", "must be in part 0 of a mesh, or in a message without a part");
    update.part = part;
  }
  return std::move(checks).result(std::move(update));
}

Result<void> appendTo(SurfaceParts& parts, const v1::SurfacePart& message) {
  const std::size_t vertices = static_cast<std::size_t>(message.positions_size()) / 3,
                    triangles = static_cast<std::size_t>(message.triangles_size()) / 3;
  if (parts.triangles.size() + triangles > model::kMaxSurfaceTriangles ||
      parts.vertices.size() + vertices > 3 * model::kMaxSurfaceTriangles)
    return tl::unexpected(FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("{} triangles and {} vertices until now are too many: a surface has at most {} "
                    "and {}; send several surfaces, or fewer triangles",
                    parts.triangles.size() + triangles, parts.vertices.size() + vertices,
                    model::kMaxSurfaceTriangles, 3 * model::kMaxSurfaceTriangles),
        telemetry::Refusal::colliders});
  for (int i = 0; i + 2 < message.positions_size(); i += 3)
    parts.vertices.emplace_back(message.positions(i), message.positions(i + 1), message.positions(i + 2));
  for (int i = 0; i + 2 < message.triangles_size(); i += 3)
    parts.triangles.push_back({message.triangles(i), message.triangles(i + 1), message.triangles(i + 2)});
  return {};
}

FieldError surfaceError(std::uint32_t id, const model::SurfaceProblem& problem) {
  std::string where;
  if (problem.vertex) where = fmt::format("vertex {} ", *problem.vertex);
  if (problem.triangle) where = fmt::format("triangle {} ", *problem.triangle);
  return {v1::ERROR_CODE_INVALID_ARGUMENT, fmt::format("surface.id = {}: {}{}", id, where, problem.text)};
}

}  // namespace clothstream::messages
