// SPDX-License-Identifier: MIT
// Converts a Scene message to a scene and checks it as a whole.
#include "server/messages/scene_message.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>

#include "server/messages/cloth_numbers.h"
#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/node_selection.h"
#include "server/messages/shapes.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"
#include "server/model/hinges.h"
#include "server/model/material.h"
#include "server/model/mesh.h"
#include "server/model/springs.h"
#include "server/model/stability.h"

namespace clothstream::messages {
namespace {

using parameters::kIterations;
using parameters::kXpbdIterations;

model::Integrator toIntegrator(Checks& checks, const Path& path, v1::Integrator message) {
  switch (message) {
    case v1::INTEGRATOR_UNSPECIFIED:
    case v1::INTEGRATOR_SEMI_IMPLICIT_EULER:
      return model::Integrator::semiImplicitEuler;
    case v1::INTEGRATOR_EXPLICIT_EULER:
      return model::Integrator::explicitEuler;
    case v1::INTEGRATOR_RUNGE_KUTTA_4:
      return model::Integrator::rungeKutta4;
    default:
      checks.fail(
          path, fmt::format("{}", static_cast<int>(message)),
          "must be INTEGRATOR_SEMI_IMPLICIT_EULER, INTEGRATOR_EXPLICIT_EULER or INTEGRATOR_RUNGE_KUTTA_4");
      return {};
  }
}

model::Coding toCoding(Checks& checks, const Path& path, v1::Coding message) {
  switch (message) {
    case v1::CODING_UNSPECIFIED:
    case v1::CODING_ENTROPY:
      return model::Coding::entropy;
    case v1::CODING_PACKED:
      return model::Coding::packed;
    default:
      checks.fail(path, fmt::format("{}", static_cast<int>(message)),
                  "must be CODING_ENTROPY or CODING_PACKED");
      return {};
  }
}

model::Normals toNormals(Checks& checks, const Path& path, v1::Normals message) {
  switch (message) {
    case v1::NORMALS_UNSPECIFIED:
    case v1::NORMALS_NONE:
      return model::Normals::none;
    case v1::NORMALS_OCTAHEDRAL:
      return model::Normals::octahedral;
    default:
      checks.fail(path, fmt::format("{}", static_cast<int>(message)),
                  "must be NORMALS_NONE or NORMALS_OCTAHEDRAL");
      return {};
  }
}

model::Environment toEnvironment(Checks& checks, const Path& path, const v1::Environment& message) {
  model::Environment environment;
  if (message.has_gravity())
    environment.gravity = toVec3(checks, path / "gravity", message.gravity(), parameters::kGravity.range);
  environment.wind = toVec3(checks, path / "wind", message.wind(), parameters::kWind.range);
  if (message.has_air_density())
    environment.airDensity =
        checks.number(path / "airDensity", message.air_density(), parameters::kAirDensity.range);
  environment.gust = toGust(checks, path / "gust", message.gust());
  return environment;
}

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

// Returns the result of toMeshCloth(); empty for a grid.
VertexNodes toShape(Checks& checks, const Path& path, const v1::Cloth& message, const MeshReader& readMesh,
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

model::Motion toMotion(Checks& checks, const Path& path, const v1::Motion& message,
                       const model::Quaternion& orientation) {
  model::Motion motion{{}, message.steady()};
  checks.count(path / "keys", static_cast<std::size_t>(message.keys_size()), 2, limits::kMaxMotionKeys);
  for (int i = 0; i < message.keys_size() && !checks.failed(); ++i) {
    const v1::MotionKey& from = message.keys(i);
    const Path key = path.at("keys", i);
    const float time = checks.number(key / "time", from.time(), limits::kMotionTime);
    if (i == 0 && time != 0)
      checks.fail(key / "time", fmt::format("{}", time), "must be 0, where the motion starts");
    if (i > 0 && time <= motion.keys.back().time)
      checks.fail(
          key / "time", fmt::format("{}", time),
          fmt::format("must be greater than the time of the key before, {}", motion.keys.back().time));
    motion.keys.push_back({time, toVec3(checks, key / "position", from.position(), limits::kPosition),
                           from.has_orientation()
                               ? toQuaternion(checks, key / "orientation", from.orientation())
                               : orientation});
  }
  return motion;
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

// A node is pinned or attached at most once.
void checkAttached(Checks& checks, const Path& path, const model::Cloth& cloth) {
  model::Cloth pinnedOnly = cloth;
  pinnedOnly.attachments.clear();
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

void readAttachments(Checks& checks, const Path& path, const v1::Cloth& message, const VertexNodes& nodes,
                     model::Cloth& cloth) {
  checks.count(path / "attachments", static_cast<std::size_t>(message.attachments_size()), 0,
               limits::kMaxAttachments);
  for (int i = 0; i < message.attachments_size() && !checks.failed(); ++i)
    cloth.attachments.push_back(
        toAttachment(checks, path.at("attachments", i), message.attachments(i), cloth, nodes));
}

// Self-collision and tethers with their defaults, if the message has them.
void addParts(Checks& checks, const Path& path, const v1::Cloth& message, model::Cloth& cloth) {
  if (message.has_self_collision())
    cloth.selfCollision = model::SelfCollision{.radius = model::shortestSpring(cloth) / 2};
  if (!message.has_tethers()) return;
  cloth.tethers.emplace();
  if (cloth.nodeCount() > limits::kMaxSolverNodes)
    checks.fail(path / "tethers", "",
                fmt::format("are for cloths of at most {} nodes; this one has {}", limits::kMaxSolverNodes,
                            cloth.nodeCount()));
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

model::Cloth toCloth(Checks& checks, const Path& path, const v1::Cloth& message, const MeshReader& readMesh,
                     const SceneLimits& most, std::vector<v1::MeshRepair>& repairs) {
  model::Cloth cloth;
  cloth.name = checks.name(path / "name", message.name());
  const VertexNodes nodes = toShape(checks, path, message, readMesh, most, cloth, repairs);
  if (checks.failed()) return cloth;
  readPins(checks, path, message, nodes, cloth);
  readAttachments(checks, path, message, nodes, cloth);
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

model::Collider toCollider(Checks& checks, const Path& path, const v1::Collider& message) {
  model::Collider collider;
  collider.name = checks.name(path / "name", message.name());
  collider.shape = toShape(checks, path, message);
  collider.pose = toPose(checks, path / "pose", message.pose());
  if (message.has_friction())
    collider.friction = checks.number(path / "friction", message.friction(), limits::kFriction);
  if (message.has_motion())
    collider.motion = toMotion(checks, path / "motion", message.motion(), collider.pose.orientation);
  return collider;
}

model::StreamSettings toStreamSettings(Checks& checks, const Path& path, const v1::StreamSettings& message) {
  model::StreamSettings settings;
  if (message.has_max_error())
    settings.maxError = checks.number(path / "maxError", message.max_error(), limits::kMaxError);
  settings.normals = toNormals(checks, path / "normals", message.normals());
  settings.coding = toCoding(checks, path / "coding", message.coding());
  if (message.has_temporal_layers())
    settings.temporalLayers = static_cast<std::uint8_t>(
        checks.integer(path / "temporalLayers", message.temporal_layers(), 1, limits::kMaxTemporalLayers));
  if (message.has_qualities())
    settings.qualities = static_cast<std::uint8_t>(
        checks.integer(path / "qualities", message.qualities(), 1, limits::kMaxQualities));
  return settings;
}

void checkRates(Checks& checks, const model::Scene& scene) {
  const Path root;
  checks.integer(root / "simulationRate", scene.simulationRate, 1, limits::kMaxRate);
  checks.integer(root / "substeps", scene.substeps, 1, limits::kMaxSubsteps);
  if (scene.streamRate == 0 || scene.simulationRate % scene.streamRate != 0)
    checks.fail(root / "streamRate", fmt::format("{}", scene.streamRate),
                fmt::format("must divide simulationRate, which is {}", scene.simulationRate));
}

template <typename Named>
void checkUnique(Checks& checks, std::string_view field, const std::vector<Named>& elements) {
  std::unordered_set<std::string_view> names;
  for (std::size_t i = 0; i < elements.size(); ++i)
    if (!names.insert(elements[i].name).second) {
      const Path root;
      const Path element = root.at(field, static_cast<int>(i));
      checks.fail(element / "name", '"' + elements[i].name + '"', "is used twice; names must be unique");
    }
}

void checkSolvers(Checks& checks, const model::Scene& scene) {
  const Path root;
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    if (const auto error = unfitSolver(scene, scene.cloths[i])) {
      const Path element = root.at("cloths", static_cast<int>(i));
      checks.fail(element / "solver", "", *error);
    }
}

void checkSelfCollision(Checks& checks, const model::Scene& scene) {
  const auto has = [](const model::Cloth& cloth) { return cloth.selfCollision.has_value(); };
  const auto first = std::ranges::find_if(scene.cloths, has);
  if (first == scene.cloths.end() || scene.nodeCount() <= limits::kMaxSelfCollisionNodes) return;
  const Path root;
  const Path element = root.at("cloths", static_cast<int>(first - scene.cloths.begin()));
  checks.fail(element / "selfCollision", "",
              fmt::format("is for scenes of at most {} nodes; this one has {}",
                          limits::kMaxSelfCollisionNodes, scene.nodeCount()));
}

// Selecting nodes takes time for every node of a range, and for every node and region. Checked before any
// node is selected.
void checkSelections(Checks& checks, const model::Scene& scene) {
  std::uint64_t tests = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    const auto add = [&](const std::vector<model::GridRange>& ranges,
                         const std::vector<model::Region>& regions) {
      for (const model::GridRange& range : ranges) tests += range.nodeCount();
      tests += std::uint64_t{cloth.nodeCount()} * regions.size();
    };
    add(cloth.pins, cloth.pinnedRegions);
    for (const model::Attachment& attachment : cloth.attachments) add(attachment.ranges, attachment.regions);
  }
  if (tests > limits::kMaxSelectionTests)
    checks.fail(
        Path("cloths"), "",
        fmt::format("have pins and attachments that select nodes in {} steps, one for each node of a range, "
                    "and for each region and node; must have at most {}: use fewer regions",
                    tests, limits::kMaxSelectionTests));
}

// Checks the attachments of all cloths together: unique names, number, and colliders that exist.
void checkAttachments(Checks& checks, const model::Scene& scene) {
  std::unordered_set<std::string_view> names;
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    for (std::size_t k = 0; k < scene.cloths[i].attachments.size(); ++k) {
      const model::Attachment& attachment = scene.cloths[i].attachments[k];
      const Path root;
      const Path cloth = root.at("cloths", static_cast<int>(i));
      const Path element = cloth.at("attachments", static_cast<int>(k));
      if (!names.insert(attachment.name).second)
        checks.fail(element / "name", '"' + attachment.name + '"', "is used twice; names must be unique");
      if (!attachment.collider.empty())
        checkKnown(checks, element / "collider", attachment.collider, scene.colliders,
                   v1::ERROR_CODE_INVALID_ARGUMENT);
    }
  checks.count(Path("attachments"), names.size(), 0, limits::kMaxAttachments);
}

std::string tooManyNodes(std::uint64_t nodes, std::uint64_t most) {
  return fmt::format("have {} nodes in all; must have at most {}", nodes, most);
}

// Nodes of grids and vertices of meshes inside the message.
std::uint64_t statedNodes(const v1::Scene& message) {
  std::uint64_t nodes = 0;
  for (const v1::Cloth& cloth : message.cloths())
    nodes += std::uint64_t{cloth.grid().rows()} * cloth.grid().columns() +
             static_cast<std::uint64_t>(cloth.mesh().positions_size()) / 3;
  return nodes;
}

// Refuses what the message states to be too large before anything is made of it.
void checkStatedSize(Checks& checks, const v1::Scene& message, const SceneLimits& most) {
  if (const std::uint64_t nodes = statedNodes(message); nodes > most.nodes)
    checks.failSize(Path("cloths"), tooManyNodes(nodes, most.nodes));
  std::size_t attachments = 0;
  for (const v1::Cloth& cloth : message.cloths())
    attachments += static_cast<std::size_t>(cloth.attachments_size());
  if (attachments > most.attachments)
    checks.failSize(Path("cloths"), fmt::format("have {} attachments in all; must have at most {}",
                                                attachments, most.attachments));
}

void checkSize(Checks& checks, const model::Scene& scene, const SceneLimits& most) {
  std::uint64_t nodes = 0, springs = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    nodes += cloth.nodeCount();
    springs += model::springCount(cloth);
  }
  // Files of meshes and repairs may give more nodes than the message states.
  const std::uint64_t mostNodes = std::min(most.nodes, limits::kMaxNodes);
  if (nodes > mostNodes) checks.failSize(Path("cloths"), tooManyNodes(nodes, mostNodes));
  if (springs > most.springs)
    checks.failSize(Path("cloths"),
                    fmt::format("have {} springs in all; must have at most {}", springs, most.springs));
  std::size_t bytes = 0;
  for (const model::Cloth& cloth : scene.cloths) bytes += geometryBytes(cloth);
  if (bytes > limits::kMaxGeometryBytes)
    checks.fail(
        Path("cloths"), "",
        fmt::format("have {} bytes of positions, triangles and texture coordinates; a client takes at most "
                    "{}: simplify the meshes, or leave their texture coordinates out",
                    bytes, limits::kMaxGeometryBytes));
}

}  // namespace

model::Gust toGust(Checks& checks, const Path& path, const v1::Gust& message) {
  model::Gust gust;
  gust.strength = checks.number(path / "strength", message.strength(), parameters::kGustStrength.range);
  if (message.has_seconds())
    gust.seconds = checks.number(path / "seconds", message.seconds(), parameters::kGustSeconds.range);
  return gust;
}

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

namespace {

std::optional<std::string> unfitAssembly(const model::Scene& scene, const model::Cloth& cloth) {
  std::uint64_t nodes = 0;
  for (const model::Cloth& one : scene.cloths) nodes += model::isAssembled(one.solver) ? one.nodeCount() : 0;
  if (nodes > limits::kMaxAssembledNodes)
    return fmt::format(
        "assembles its system (CONSTRAINT_PATH_ASSEMBLED), for cloths of at most {} nodes in all; here they "
        "have {}",
        limits::kMaxAssembledNodes, nodes);
  const std::uint64_t entries = model::systemEntries(cloth);
  if (entries > limits::kMaxAssembledEntries * cloth.nodeCount())
    return fmt::format(
        "assembles its system (CONSTRAINT_PATH_ASSEMBLED), for matrices of at most {} entries a node; this "
        "one's has {} for {} nodes",
        limits::kMaxAssembledEntries, entries, cloth.nodeCount());
  return std::nullopt;
}

}  // namespace

std::optional<std::string> unfitSolver(const model::Scene& scene, const model::Cloth& cloth) {
  if (cloth.solver.kind == model::SolverKind::massSpring) return std::nullopt;
  if (scene.integrator != model::Integrator::semiImplicitEuler)
    return "solves a system, which needs INTEGRATOR_SEMI_IMPLICIT_EULER";
  if (cloth.nodeCount() > limits::kMaxSolverNodes)
    return fmt::format("solves a system, for at most {} nodes; this cloth has {}", limits::kMaxSolverNodes,
                       cloth.nodeCount());
  return model::isAssembled(cloth.solver) ? unfitAssembly(scene, cloth) : std::nullopt;
}

std::optional<std::string> unfitBending(const model::Scene& scene) {
  std::uint64_t nodes = 0;
  for (const model::Cloth& cloth : scene.cloths) nodes += cloth.dihedralBending > 0 ? cloth.nodeCount() : 0;
  if (nodes == 0) return std::nullopt;
  if (scene.integrator != model::Integrator::semiImplicitEuler)
    return "must be 0: other values need INTEGRATOR_SEMI_IMPLICIT_EULER";
  if (nodes > model::kMaxBendingNodes)
    return fmt::format("must be 0 but for cloths of at most {} nodes in all; here they have {}",
                       model::kMaxBendingNodes, nodes);
  return std::nullopt;
}

std::optional<std::string> instability(const model::Scene& scene, const model::StabilityBound& bound) {
  const std::uint32_t needed = bound.substeps(scene);
  if (needed != 0 && needed <= scene.substeps) return std::nullopt;
  if (needed != 0)
    return fmt::format("this scene needs at least {} with its springs, masses and rate", needed);
  if (scene.integrator == model::Integrator::explicitEuler)
    return fmt::format(
        "no number up to {} keeps this scene stable: INTEGRATOR_EXPLICIT_EULER needs springs with a damping "
        "of at least their stiffness times the step, and also a cloth damping; or use "
        "INTEGRATOR_SEMI_IMPLICIT_EULER",
        limits::kMaxSubsteps);
  return fmt::format(
      "no number up to {} keeps this scene stable: lower stiffness or damping, or raise mass or "
      "simulationRate",
      limits::kMaxSubsteps);
}

Result<model::Scene> toScene(const v1::Scene& message, const MeshReader& readMesh, const SceneLimits& most,
                             std::vector<v1::MeshRepair>* repairs) {
  std::vector<v1::MeshRepair> unasked;
  Checks checks;
  const Path root;
  model::Scene scene;
  checkStatedSize(checks, message, most);
  scene.name = checks.name(root / "name", message.name());
  scene.description = checks.text(root / "description", message.description());
  if (message.has_simulation_rate()) scene.simulationRate = message.simulation_rate();
  scene.streamRate = message.has_stream_rate() ? message.stream_rate()
                                               : std::min(limits::kDefaultStreamRate, scene.simulationRate);
  if (message.has_substeps()) scene.substeps = message.substeps();
  checkRates(checks, scene);
  scene.integrator = toIntegrator(checks, root / "integrator", message.integrator());
  scene.environment = toEnvironment(checks, root / "environment", message.environment());

  checks.count(root / "cloths", static_cast<std::size_t>(message.cloths_size()), 1, limits::kMaxCloths);
  checks.count(root / "colliders", static_cast<std::size_t>(message.colliders_size()), 0,
               limits::kMaxColliders);
  const std::uint64_t mostNodes = std::min(most.nodes, limits::kMaxNodes);
  std::uint64_t nodes = 0;
  for (int i = 0; i < message.cloths_size() && !checks.failed(); ++i) {
    const v1::Cloth& cloth = message.cloths(i);
    // A repair adds nodes that the message does not state: at most those that earlier cloths have left.
    SceneLimits left = most;
    if (cloth.mesh().repair()) left.nodes = mostNodes - nodes;
    scene.cloths.push_back(
        toCloth(checks, root.at("cloths", i), cloth, readMesh, left, repairs ? *repairs : unasked));
    nodes = std::min(mostNodes, nodes + scene.cloths.back().nodeCount());
  }
  for (int i = 0; i < message.colliders_size() && !checks.failed(); ++i)
    scene.colliders.push_back(toCollider(checks, root.at("colliders", i), message.colliders(i)));
  scene.stream = toStreamSettings(checks, root / "stream", message.stream());
  // Sizes first: the other checks take time in proportion to them.
  checkSize(checks, scene, most);
  most.cancellation.check();
  if (!checks.failed()) checkSelections(checks, scene);
  for (std::size_t i = 0; i < scene.cloths.size() && !checks.failed(); ++i)
    if (!scene.cloths[i].attachments.empty())
      checkAttached(checks, root.at("cloths", static_cast<int>(i)), scene.cloths[i]);
  if (!message.stream().has_max_error() && !checks.failed())
    scene.stream.maxError = model::suitedMaxError(scene);
  most.cancellation.check();
  checkUnique(checks, "cloths", scene.cloths);
  checkUnique(checks, "colliders", scene.colliders);
  checkAttachments(checks, scene);
  checkSolvers(checks, scene);
  checkSelfCollision(checks, scene);
  if (const auto error = unfitBending(scene)) checks.fail(Path("cloths[].dihedralBending"), "", *error);
  most.cancellation.check();
  if (!checks.failed())
    if (const auto error = instability(scene, model::StabilityBound(scene)))
      checks.fail(root / "substeps", fmt::format("{}", scene.substeps), *error);
  return std::move(checks).result(std::move(scene));
}

}  // namespace clothstream::messages
