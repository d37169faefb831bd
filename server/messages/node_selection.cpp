// SPDX-License-Identifier: MIT
// Converts the nodes that pins and attachments select.
#include "server/messages/node_selection.h"

#include <fmt/format.h>

#include "server/meshes/mesh_source.h"
#include "server/messages/limits.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

model::GridRange toRange(Checks& checks, const Path& path, const v1::GridRange& message,
                         const model::Grid& grid) {
  model::GridRange range;
  range.firstRow = checks.integer(path / "firstRow", message.first_row(), 0, grid.rows - 1);
  range.firstColumn = checks.integer(path / "firstColumn", message.first_column(), 0, grid.columns - 1);
  range.lastRow = message.has_last_row()
                      ? checks.integer(path / "lastRow", message.last_row(), range.firstRow, grid.rows - 1)
                      : range.firstRow;
  range.lastColumn = message.has_last_column() ? checks.integer(path / "lastColumn", message.last_column(),
                                                                range.firstColumn, grid.columns - 1)
                                               : range.firstColumn;
  if (message.has_row_step())
    range.rowStep = checks.integer(path / "rowStep", message.row_step(), 1, limits::kMaxGridNodes);
  if (message.has_column_step())
    range.columnStep = checks.integer(path / "columnStep", message.column_step(), 1, limits::kMaxGridNodes);
  return range;
}

std::uint32_t toNode(Checks& checks, const Path& path, std::uint32_t vertex, const model::Cloth& cloth,
                     const std::vector<std::uint32_t>& nodeOfVertex) {
  if (!cloth.mesh) return checks.integer(path, vertex, 0, cloth.grid.nodeCount() - 1);
  checks.integer(path, vertex, 0, static_cast<std::uint32_t>(nodeOfVertex.size()) - 1);
  if (checks.failed()) return 0;
  if (nodeOfVertex[vertex] == meshes::kNoNode)
    checks.fail(path, fmt::format("{}", vertex),
                "is a vertex without a face, so it has no node; name a vertex of a face");
  return nodeOfVertex[vertex];
}

}  // namespace

model::Region toRegion(Checks& checks, const Path& path, const v1::Region& message) {
  model::Region region;
  region.centre = toVec3(checks, path / "centre", message.centre(), limits::kPosition);
  switch (message.shape_case()) {
    case v1::Region::kRadius:
      region.radius = checks.number(path / "radius", message.radius(), limits::kRegionLength);
      break;
    case v1::Region::kSize:
      region.size = toVec3(checks, path / "size", message.size(), limits::kRegionLength);
      break;
    case v1::Region::SHAPE_NOT_SET:
      checks.fail(path, "", "has no shape; must have \"radius\" or \"size\"");
  }
  return region;
}

NodeSelection toSelection(Checks& checks, const Path& path, const NamedNodes& named,
                          const model::Cloth& cloth, const VertexNodes& nodes) {
  NodeSelection selection;
  checks.count(path / named.rangesField, static_cast<std::size_t>(named.ranges.size()), 0, limits::kMaxPins);
  checks.count(path / named.regionsField, static_cast<std::size_t>(named.regions.size()), 0,
               limits::kMaxPins);
  // More entries than vertices would name a vertex twice.
  checks.count(path / named.verticesField, static_cast<std::size_t>(named.vertices.size()), 0,
               cloth.mesh ? nodes.nodeOfVertex.size() : cloth.grid.nodeCount());
  if (cloth.mesh && !named.ranges.empty())
    checks.fail(path / named.rangesField, "",
                fmt::format("must be absent for a mesh; use \"{}\" or \"{}\"", named.verticesField,
                            named.regionsField));
  // A node is listed once, because several vertices of a mesh may have the same node.
  std::vector<bool> listed(named.vertices.empty() || checks.failed() ? 0 : cloth.nodeCount());
  for (int i = 0; i < named.vertices.size() && !checks.failed(); ++i) {
    std::uint32_t node =
        toNode(checks, path.at(named.verticesField, i), named.vertices[i], cloth, nodes.nodeOfVertex);
    while (!checks.failed() && node != meshes::kNoNode && !listed[node]) {
      listed[node] = true;
      selection.vertices.push_back(node);
      node = nodes.nextCopy.empty() ? meshes::kNoNode : nodes.nextCopy[node];
    }
  }
  for (int i = 0; i < named.ranges.size() && !checks.failed(); ++i)
    selection.ranges.push_back(toRange(checks, path.at(named.rangesField, i), named.ranges[i], cloth.grid));
  for (int i = 0; i < named.regions.size() && !checks.failed(); ++i)
    selection.regions.push_back(toRegion(checks, path.at(named.regionsField, i), named.regions[i]));
  return selection;
}

void write(const model::GridRange& range, v1::GridRange& message) {
  message.set_first_row(range.firstRow);
  message.set_last_row(range.lastRow);
  message.set_row_step(range.rowStep);
  message.set_first_column(range.firstColumn);
  message.set_last_column(range.lastColumn);
  message.set_column_step(range.columnStep);
}

void write(const model::Region& region, v1::Region& message) {
  write(region.centre, *message.mutable_centre());
  if (region.radius)
    message.set_radius(*region.radius);
  else
    write(region.size, *message.mutable_size());
}

}  // namespace clothstream::messages
