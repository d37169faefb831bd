// SPDX-License-Identifier: MIT
// Converts a Scene message to a scene and checks it as a whole.
#include "server/messages/scene_message.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <fmt/format.h>

#include "server/messages/cloth_message.h"
#include "server/messages/cloth_skin_message.h"
#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/local_wind.h"
#include "server/messages/parameter_numbers.h"
#include "server/messages/shapes.h"
#include "server/messages/solid_message.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"
#include "server/model/coarse_level.h"
#include "server/model/gas.h"
#include "server/model/hinges.h"
#include "server/model/input.h"
#include "server/model/mesh.h"
#include "server/model/origin.h"
#include "server/model/springs.h"
#include "server/model/stability.h"

namespace clothstream::messages {
namespace {

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

model::Collider toCollider(Checks& checks, const Path& path, const v1::Collider& message,
                           const MeshReader& readMesh) {
  model::Collider collider;
  collider.name = checks.name(path / "name", message.name());
  collider.shape = toShape(checks, path, message, readMesh);
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

void checkPressure(Checks& checks, const model::Scene& scene) {
  for (std::size_t i = 0; i < scene.cloths.size() && !checks.failed(); ++i)
    if (const auto error = unfitPressure(scene, scene.cloths[i]))
      checks.fail(Path().at("cloths", static_cast<int>(i)) / "pressure",
                  fmt::format("{}", scene.cloths[i].pressure), *error);
}

void checkCoarse(Checks& checks, const model::Scene& scene) {
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    if (const auto error = unfitCoarse(scene, scene.cloths[i]))
      checks.fail(Path().at("cloths", static_cast<int>(i)) / "coarse", "", *error);
}

void checkMotionBound(Checks& checks, const model::Scene& scene) {
  const Path root;
  std::uint64_t nodes = 0;
  for (std::size_t i = 0; i < scene.cloths.size() && !checks.failed(); ++i) {
    const model::Cloth& cloth = scene.cloths[i];
    if (!model::boundsMotion(cloth)) continue;
    nodes += cloth.nodeCount();
    const auto refuse = [&](const std::string& reason) {
      checks.fail(root.at("cloths", static_cast<int>(i)) / "selfCollision" / "nothingPasses", "true", reason);
    };
    if (nodes > limits::kMaxBoundNodes)
      refuse(fmt::format("is for at most {} nodes in all cloths that have it; with this one they are {}",
                         limits::kMaxBoundNodes, nodes));
    if (cloth.coarse) refuse("is for cloths without \"coarse\", whose corrections nothing bounds");
  }
}

// Clients refuse descriptions with more parts.
void checkParts(Checks& checks, const model::Scene& scene) {
  constexpr std::size_t kMost = 65'536;
  std::size_t parts = 0;
  for (const model::Cloth& cloth : scene.cloths) parts += cloth.mesh ? cloth.mesh->shape.submeshes.size() : 0;
  if (parts > kMost)
    checks.fail(
        Path("cloths"), "",
        fmt::format("have meshes with {} parts in all; must have at most {}: join parts with the same "
                    "material",
                    parts, kMost));
}

// Selecting nodes takes time for every node of a range, and for every node and region. Checked before any
// node is selected.
void checkSelections(Checks& checks, const model::Scene& scene, const v1::Scene& message) {
  std::uint64_t tests = 0;
  for (std::size_t i = 0; i < scene.cloths.size(); ++i) {
    const model::Cloth& cloth = scene.cloths[i];
    const int ofSkin = message.cloths(static_cast<int>(i)).skin().regions_size();
    tests += std::uint64_t{cloth.nodeCount()} * static_cast<std::uint64_t>(ofSkin);
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
        fmt::format("have pins, attachments and skins that select nodes in {} steps, one for each node of a "
                    "range, and for each region and node; must have at most {}: use fewer regions",
                    tests, limits::kMaxSelectionTests));
}

// A stream holds no position beyond its reach, and a cloth that starts there could not be sent.
void checkReach(Checks& checks, const model::Scene& scene) {
  const float reach = model::reachOf(scene.stream);
  const model::Vec3 origin = model::originOf(scene);
  for (std::size_t i = 0; i < scene.cloths.size(); ++i) {
    const float farthest = model::farthestFrom(origin, scene.cloths[i]);
    if (farthest <= reach) continue;
    return checks.fail(
        Path().at("cloths", static_cast<int>(i)), "",
        fmt::format("has a node {:.6g} m from ({}, {}, {}), the middle of the scene, along an axis; must be "
                    "within {:.4g} m, which is what a stream with a maxError of {:.4g} m holds: place the "
                    "cloths nearer to one another, or set stream.maxError to {} or more",
                    farthest, origin.x(), origin.y(), origin.z(), reach, scene.stream.maxError,
                    model::maxErrorFor(farthest)));
  }
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

void checkSolids(Checks& checks, const v1::Scene& message) {
  const auto count = std::ranges::count_if(message.colliders(), &v1::Collider::has_mesh);
  if (static_cast<std::size_t>(count) > limits::kMaxSolids)
    checks.fail(Path("colliders"), "",
                fmt::format("have {} meshes; must have at most {}", count, limits::kMaxSolids));
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
  for (const model::Collider& collider : scene.colliders)
    if (const auto* solid = std::get_if<model::Solid>(&collider.shape)) bytes += geometryBytes(**solid);
  if (bytes > limits::kMaxGeometryBytes)
    checks.fail(
        Path("cloths"), "",
        fmt::format("have {} bytes of positions, triangles and texture coordinates; a client takes at most "
                    "{}: simplify the meshes, or leave their texture coordinates out",
                    bytes, limits::kMaxGeometryBytes));
}

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

std::optional<std::string> unfitPressure(const model::Scene& scene, const model::Cloth& cloth) {
  if (!model::hasGas(cloth)) return std::nullopt;
  if (scene.integrator != model::Integrator::semiImplicitEuler)
    return "must be 0: other values need INTEGRATOR_SEMI_IMPLICIT_EULER";
  if (const auto reason = model::unfitForGas(cloth)) return fmt::format("must be 0: the cloth {}", *reason);
  return std::nullopt;
}

std::optional<std::string> unfitCoarse(const model::Scene& scene, const model::Cloth& cloth) {
  if (!cloth.coarse) return std::nullopt;
  if (scene.integrator != model::Integrator::semiImplicitEuler)
    return "must be absent with this integrator: it needs INTEGRATOR_SEMI_IMPLICIT_EULER";
  const float least = model::leastCoarseDamping(cloth, scene.substepSeconds());
  const bool forces =
      cloth.solver.kind == model::SolverKind::massSpring || cloth.solver.kind == model::SolverKind::acad;
  if (!forces || cloth.structural.damping >= least) return std::nullopt;
  return fmt::format(
      "needs structural springs with a damping of at least {:.3g} N s/m with this mass, rate and substeps: "
      "fast "
      "colliders make the cloth unstable with less",
      least);
}

std::string outOfReach(const model::Scene& scene) {
  const model::Vec3 origin = model::originOf(scene);
  return fmt::format(
      "cloth left the range that the stream holds, {:.4g} m from ({}, {}, {}) along each axis at a "
      "maxError of {:.4g} m",
      model::reachOf(scene.stream), origin.x(), origin.y(), origin.z(), scene.stream.maxError);
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
  model::applyChange(scene.environment, readNumbers(checks, root / "environment", message.environment()));
  scene.winds = toSceneWinds(checks, root / "environment", message.environment());

  checks.count(root / "cloths", static_cast<std::size_t>(message.cloths_size()), 1, limits::kMaxCloths);
  checks.count(root / "colliders", static_cast<std::size_t>(message.colliders_size()), 0,
               limits::kMaxColliders);
  checkSolids(checks, message);
  const std::uint64_t mostNodes = std::min(most.nodes, limits::kMaxNodes);
  std::uint64_t nodes = 0;
  std::vector<ClothVertices> vertices(static_cast<std::size_t>(message.cloths_size()));
  for (int i = 0; i < message.cloths_size() && !checks.failed(); ++i) {
    const v1::Cloth& cloth = message.cloths(i);
    // A repair adds nodes that the message does not state: at most those that earlier cloths have left.
    SceneLimits left = most;
    if (cloth.mesh().repair()) left.nodes = mostNodes - nodes;
    ClothVertices& own = vertices[static_cast<std::size_t>(i)];
    scene.cloths.push_back(
        toCloth(checks, root.at("cloths", i), cloth, readMesh, left, own, repairs ? *repairs : unasked));
    if (!cloth.has_skin()) own = {};
    nodes = std::min(mostNodes, nodes + scene.cloths.back().nodeCount());
  }
  for (int i = 0; i < message.colliders_size() && !checks.failed(); ++i)
    scene.colliders.push_back(toCollider(checks, root.at("colliders", i), message.colliders(i), readMesh));
  scene.stream = toStreamSettings(checks, root / "stream", message.stream());
  // Sizes first: the other checks take time in proportion to them.
  checkSize(checks, scene, most);
  most.cancellation.check();
  if (!checks.failed()) checkSelections(checks, scene, message);
  for (std::size_t i = 0; i < scene.cloths.size() && !checks.failed(); ++i)
    if (const v1::Cloth& cloth = message.cloths(static_cast<int>(i)); cloth.has_skin())
      scene.cloths[i].skin =
          toClothSkin(checks, root.at("cloths", static_cast<int>(i)) / "skin", cloth.skin(), scene.colliders,
                      scene.cloths[i], vertices[i], most.cancellation);
  for (std::size_t i = 0; i < scene.cloths.size() && !checks.failed(); ++i)
    if (!scene.cloths[i].attachments.empty())
      checkAttached(checks, root.at("cloths", static_cast<int>(i)), scene.cloths[i]);
  if (!message.stream().has_max_error() && !checks.failed())
    scene.stream.maxError = model::suitedMaxError(scene);
  most.cancellation.check();
  if (!checks.failed()) checkReach(checks, scene);
  checkUnique(checks, "cloths", scene.cloths);
  checkUnique(checks, "colliders", scene.colliders);
  checkAttachments(checks, scene);
  checkSolvers(checks, scene);
  checkSelfCollision(checks, scene);
  checkMotionBound(checks, scene);
  checkParts(checks, scene);
  checkCoarse(checks, scene);
  if (const auto error = unfitBending(scene)) checks.fail(Path("cloths[].dihedralBending"), "", *error);
  checkPressure(checks, scene);
  most.cancellation.check();
  if (!checks.failed())
    if (const auto error = instability(scene, model::StabilityBound(scene)))
      checks.fail(root / "substeps", fmt::format("{}", scene.substeps), *error);
  return std::move(checks).result(std::move(scene));
}

}  // namespace clothstream::messages
