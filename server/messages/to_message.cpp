// SPDX-License-Identifier: MIT
// Converts a scene to its message.
#include "server/messages/cloth_skin_message.h"
#include "server/messages/local_wind.h"
#include "server/messages/node_selection.h"
#include "server/messages/parameter_numbers.h"
#include "server/messages/scene_message.h"
#include "server/messages/shapes.h"
#include "server/messages/solid_message.h"
#include "server/messages/solver_message.h"
#include "server/messages/vectors.h"
#include "server/model/cloth_skin.h"
#include "server/model/mesh.h"

namespace clothstream::messages {
namespace {

void writeGrid(const model::Grid& grid, v1::Grid& message) {
  message.set_rows(grid.rows);
  message.set_columns(grid.columns);
  message.set_width(grid.width);
  message.set_height(grid.height);
  write(grid.pose, *message.mutable_pose());
}

void writeAttachment(const model::Attachment& attachment, v1::Attachment& message) {
  message.set_name(attachment.name);
  for (const model::GridRange& range : attachment.ranges) write(range, *message.add_ranges());
  message.mutable_vertices()->Add(attachment.vertices.begin(), attachment.vertices.end());
  for (const model::Region& region : attachment.regions) write(region, *message.add_regions());
  if (!attachment.collider.empty()) {
    message.set_collider(attachment.collider);
    return;
  }
  write(attachment.pose, *message.mutable_pose());
  if (!attachment.motion.keys.empty()) write(attachment.motion, *message.mutable_motion());
}

void writeCoarse(const model::CoarseCorrection& coarse, v1::CoarseCorrection& message) {
  message.set_cells(coarse.cells);
  message.set_sweeps(coarse.sweeps);
  message.set_every(coarse.every);
  message.set_levels(coarse.levels);
}

void writeCloth(const model::Cloth& cloth, v1::Cloth& message) {
  message.set_name(cloth.name);
  if (cloth.mesh)
    message.mutable_mesh();
  else
    writeGrid(cloth.grid, *message.mutable_grid());
  message.set_mass(cloth.mass);
  message.set_material(cloth.material);
  writeNumbers(cloth, message);
  if (model::boundsMotion(cloth)) message.mutable_self_collision()->set_nothing_passes(true);
  for (const model::GridRange& range : cloth.pins) write(range, *message.add_pins());
  *message.mutable_solver() = toMessage(cloth.solver);
  if (cloth.coarse) writeCoarse(*cloth.coarse, *message.mutable_coarse());
  message.mutable_pinned_vertices()->Add(cloth.pinnedVertices.begin(), cloth.pinnedVertices.end());
  for (const model::Region& region : cloth.pinnedRegions) write(region, *message.add_pinned_regions());
  for (const model::Attachment& attachment : cloth.attachments)
    writeAttachment(attachment, *message.add_attachments());
  if (cloth.skin) message.mutable_skin()->set_collider(cloth.skin->collider);
}

void writeCollider(const model::Collider& collider, v1::Collider& message) {
  message.set_name(collider.name);
  write(collider.shape, message);
  write(collider.pose, *message.mutable_pose());
  message.set_friction(collider.friction);
  if (!collider.motion.keys.empty()) write(collider.motion, *message.mutable_motion());
}

v1::Integrator toMessage(model::Integrator integrator) {
  switch (integrator) {
    case model::Integrator::explicitEuler:
      return v1::INTEGRATOR_EXPLICIT_EULER;
    case model::Integrator::rungeKutta4:
      return v1::INTEGRATOR_RUNGE_KUTTA_4;
    default:
      return v1::INTEGRATOR_SEMI_IMPLICIT_EULER;
  }
}

}  // namespace

v1::Normals toMessage(model::Normals normals) {
  return normals == model::Normals::octahedral ? v1::NORMALS_OCTAHEDRAL : v1::NORMALS_NONE;
}

v1::Scene toMessage(const model::Scene& scene) {
  v1::Scene message = toMessageWithoutMeshes(scene);
  for (std::size_t i = 0; i < scene.cloths.size(); ++i) {
    const model::Cloth& cloth = scene.cloths[i];
    v1::Cloth& to = *message.mutable_cloths(static_cast<int>(i));
    if (cloth.mesh) write(*cloth.mesh, *to.mutable_mesh());
    if (cloth.skin) write(*cloth.skin, *to.mutable_skin());
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i)
    if (const auto* solid = std::get_if<model::Solid>(&scene.colliders[i].shape))
      write(**solid, *message.mutable_colliders(static_cast<int>(i))->mutable_mesh());
  return message;
}

v1::Scene toMessageWithoutMeshes(const model::Scene& scene) {
  v1::Scene message;
  message.set_name(scene.name);
  message.set_description(scene.description);
  message.set_simulation_rate(scene.simulationRate);
  message.set_stream_rate(scene.streamRate);
  message.set_substeps(scene.substeps);
  message.set_integrator(toMessage(scene.integrator));
  writeNumbers(scene.environment, *message.mutable_environment());
  for (const model::SceneWind& wind : scene.winds) write(wind, *message.mutable_environment()->add_winds());
  for (const model::Cloth& cloth : scene.cloths) writeCloth(cloth, *message.add_cloths());
  for (const model::Collider& collider : scene.colliders) writeCollider(collider, *message.add_colliders());
  message.mutable_stream()->set_max_error(scene.stream.maxError);
  message.mutable_stream()->set_normals(toMessage(scene.stream.normals));
  message.mutable_stream()->set_qualities(scene.stream.qualities);
  return message;
}

v1::ParameterChange allParameters(const v1::Scene& scene, std::span<const double> areas) {
  v1::ParameterChange change;
  copyNumbers(scene.environment(), change);
  for (std::size_t i = 0; i < static_cast<std::size_t>(scene.cloths_size()); ++i) {
    const v1::Cloth& cloth = scene.cloths(static_cast<int>(i));
    v1::ClothChange& all = *change.add_cloths();
    all.set_name(cloth.name());
    if (i < areas.size() && areas[i] > 0)
      all.set_areal_mass(static_cast<float>(double{cloth.mass()} / areas[i]));
    all.set_material(cloth.material());  // an empty name clears the material that a client knows
    copyNumbers(cloth, all);
    *all.mutable_solver() = cloth.solver();
  }
  return change;
}

}  // namespace clothstream::messages
