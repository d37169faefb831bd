// SPDX-License-Identifier: MIT
#include "server/messages/cloth_message.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/node_selection.h"
#include "server/messages/parameter_numbers.h"
#include "server/messages/solver_message.h"
#include "server/messages/vectors.h"
#include "server/model/mesh.h"
#include "server/model/springs.h"

namespace clothstream::messages {
namespace {

model::Grid toGrid(Checks& checks, const Path& path, const v1::Grid& message) {
  model::Grid grid;
  grid.rows = checks.integer(path / "rows", message.rows(), limits::kMinGridNodes, limits::kMaxGridNodes);
  grid.columns =
      checks.integer(path / "columns", message.columns(), limits::kMinGridNodes, limits::kMaxGridNodes);
  grid.width = checks.number(path / "width", message.width(), limits::kGridLength);
  grid.height = checks.number(path / "height", message.height(), limits::kGridLength);
  grid.pose = toPose(checks, path / "pose", message.pose());
  const auto spaced = [&](std::string_view field, float length, std::uint32_t nodes, std::string_view what) {
    const double least = (nodes - 1) * limits::kMinSpacing;
    if (length < least)
      checks.fail(path / field, fmt::format("{}", length),
                  fmt::format("must be at least {:g} with {} {}: nodes lie at least {:g} m apart", least,
                              nodes, what, limits::kMinSpacing));
  };
  if (checks.failed()) return grid;
  spaced("width", grid.width, grid.columns, "columns");
  spaced("height", grid.height, grid.rows, "rows");
  return grid;
}

// Returns the result of toMeshCloth(); empty for a grid.
ClothVertices toShape(Checks& checks, const Path& path, const v1::Cloth& message, const MeshReader& readMesh,
                      const SceneLimits& most, model::Cloth& cloth, std::vector<v1::MeshRepair>& repairs) {
  switch (message.shape_case()) {
    case v1::Cloth::kGrid:
      cloth.grid = toGrid(checks, path / "grid", message.grid());
      break;
    case v1::Cloth::kMesh:
      return toMeshCloth(checks, path, message, readMesh, most, cloth, repairs);
    case v1::Cloth::SHAPE_NOT_SET:
      checks.fail(path, "", "has no shape; must have \"grid\" or \"mesh\"");
  }
  return {};
}

void readPins(Checks& checks, const Path& path, const v1::Cloth& message, const VertexNodes& nodes,
              model::Cloth& cloth) {
  NodeSelection pins = toSelection(checks, path,
                                   {"pins", "pinnedVertices", "pinnedRegions", message.pins(),
                                    message.pinned_vertices(), message.pinned_regions()},
                                   cloth, nodes);
  cloth.pins = std::move(pins.ranges);
  cloth.pinnedVertices = std::move(pins.vertices);
  cloth.pinnedRegions = std::move(pins.regions);
}

model::Attachment toAttachment(Checks& checks, const Path& path, const v1::Attachment& message,
                               const model::Cloth& cloth, const VertexNodes& vertexNodes) {
  model::Attachment attachment;
  attachment.name = checks.name(path / "name", message.name());
  NodeSelection nodes =
      toSelection(checks, path,
                  {"ranges", "vertices", "regions", message.ranges(), message.vertices(), message.regions()},
                  cloth, vertexNodes);
  attachment.ranges = std::move(nodes.ranges);
  attachment.vertices = std::move(nodes.vertices);
  attachment.regions = std::move(nodes.regions);
  attachment.collider = message.collider();
  if (!message.collider().empty() && (message.has_pose() || message.has_motion()))
    checks.fail(path / "collider", '"' + message.collider() + '"',
                "is given together with a pose or motion; give one or the other");
  attachment.pose = toPose(checks, path / "pose", message.pose());
  if (message.has_motion())
    attachment.motion = toMotion(checks, path / "motion", message.motion(), attachment.pose.orientation);
  return attachment;
}

void readAttachments(Checks& checks, const Path& path, const v1::Cloth& message, const VertexNodes& nodes,
                     model::Cloth& cloth) {
  checks.count(path / "attachments", static_cast<std::size_t>(message.attachments_size()), 0,
               limits::kMaxAttachments);
  for (int i = 0; i < message.attachments_size() && !checks.failed(); ++i)
    cloth.attachments.push_back(
        toAttachment(checks, path.at("attachments", i), message.attachments(i), cloth, nodes));
}

model::CoarseCorrection toCoarse(Checks& checks, const Path& path, const v1::CoarseCorrection& message) {
  model::CoarseCorrection coarse;
  if (message.has_cells())
    coarse.cells =
        checks.integer(path / "cells", message.cells(), limits::kMinCoarseCells, limits::kMaxCoarseCells);
  if (message.has_sweeps())
    coarse.sweeps = checks.integer(path / "sweeps", message.sweeps(), 1u, limits::kMaxCoarseSweeps);
  if (message.has_every())
    coarse.every = checks.integer(path / "every", message.every(), 1u, limits::kMaxCoarseEvery);
  if (message.has_levels())
    coarse.levels = checks.integer(path / "levels", message.levels(), 1u, limits::kMaxCoarseLevels);
  return coarse;
}

// Self-collision and tethers with their defaults, and the coarse correction, if the message has them.
void addParts(Checks& checks, const Path& path, const v1::Cloth& message, model::Cloth& cloth) {
  if (message.has_self_collision())
    cloth.selfCollision = model::SelfCollision{.radius = model::shortestSpring(cloth) / 2,
                                               .nothingPasses = message.self_collision().nothing_passes()};
  const auto bounded = [&](std::string_view field, std::string_view verb) {
    if (cloth.nodeCount() > limits::kMaxSolverNodes)
      checks.fail(path / field, "",
                  fmt::format("{} for cloths of at most {} nodes; this one has {}", verb,
                              limits::kMaxSolverNodes, cloth.nodeCount()));
  };
  if (message.has_tethers()) {
    cloth.tethers.emplace();
    bounded("tethers", "are");
  }
  if (message.has_coarse()) {
    cloth.coarse = toCoarse(checks, path / "coarse", message.coarse());
    bounded("coarse", "is");
  }
}

// Mass in kg. The cloth already has the mass of its material.
void readMass(Checks& checks, const Path& path, const v1::Cloth& message, model::Cloth& cloth) {
  if (message.has_mass() && message.has_areal_mass())
    checks.fail(path / "arealMass", fmt::format("{}", message.areal_mass()),
                "must be absent if \"mass\" is given; give one or the other");
  if (message.has_mass()) {
    cloth.mass = checks.number(path / "mass", message.mass(), limits::kMass);
    return;
  }
  const double area = model::areaOf(cloth);
  if (message.has_areal_mass())
    cloth.mass = static_cast<float>(
        double{checks.number(path / "arealMass", message.areal_mass(), limits::kArealMass)} * area);
  checks.derivedMass(path / "arealMass",
                     message.has_areal_mass() ? fmt::format("{}", message.areal_mass()) : std::string(),
                     cloth.mass, area);
}

}  // namespace

const model::Material* toMaterial(Checks& checks, const Path& path, const std::string& name) {
  const model::Material* material = model::findMaterial(name);
  if (material == nullptr) {
    std::string known;
    for (const model::Material& one : model::materials())
      known += fmt::format("{}{}", known.empty() ? "" : ", ", one.name);
    checks.failNamed(path, name, fmt::format("must be one of {}", known));
  }
  return material;
}

void checkAttached(Checks& checks, const Path& path, const model::Cloth& cloth) {
  model::Cloth pinnedOnly = cloth;
  pinnedOnly.attachments.clear();
  pinnedOnly.skin = nullptr;
  std::vector<std::uint8_t> held = model::pinnedNodes(pinnedOnly);
  for (std::size_t i = 0; i < cloth.attachments.size(); ++i) {
    const Path element = path.at("attachments", static_cast<int>(i));
    const std::vector<std::uint8_t> attached = model::attachedNodes(cloth, cloth.attachments[i]);
    if (std::ranges::find(attached, 1) == attached.end())
      checks.fail(element, "",
                  "has no node; must have one at least of \"ranges\", \"vertices\" and \"regions\"");
    for (std::size_t node = 0; node < attached.size() && !checks.failed(); ++node) {
      if (attached[node] == 0) continue;
      if (held[node] != 0)
        checks.fail(element, "", fmt::format("has node {}, which is pinned or attached already", node));
      held[node] = 1;
    }
  }
}

model::Cloth toCloth(Checks& checks, const Path& path, const v1::Cloth& message, const MeshReader& readMesh,
                     const SceneLimits& most, ClothVertices& vertices, std::vector<v1::MeshRepair>& repairs) {
  model::Cloth cloth;
  cloth.name = checks.name(path / "name", message.name());
  vertices = toShape(checks, path, message, readMesh, most, cloth, repairs);
  if (checks.failed()) return cloth;
  readPins(checks, path, message, vertices.nodes, cloth);
  readAttachments(checks, path, message, vertices.nodes, cloth);
  if (checks.failed()) return cloth;
  addParts(checks, path, message, cloth);
  cloth.mass = static_cast<float>(double{limits::kDefaultArealMass} * model::areaOf(cloth));
  if (!message.material().empty())
    if (const model::Material* material = toMaterial(checks, path / "material", message.material()))
      model::makeOf(*material, cloth);
  readMass(checks, path, message, cloth);
  parameters::applyNumbers(readNumbers(checks, path, message, cloth), [&](parameters::ClothNumber number) {
    return parameters::memberOf(cloth, number);
  });
  if (message.has_solver()) cloth.solver = toSolver(checks, path / "solver", message.solver());
  return cloth;
}

}  // namespace clothstream::messages
