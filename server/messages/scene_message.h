// SPDX-License-Identifier: MIT
// Converts scenes between their message and the model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/messages/mesh_message.h"
#include "server/messages/scene_limits.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"
#include "server/model/stability.h"

namespace clothstream::messages {

// Applies the defaults of scene.proto and checks everything: ranges, unique names, pins inside their grid,
// meshes, rates, the number of nodes, and that the integrator is stable with these substeps. Refuses mesh
// files if there is no reader. Refuses more nodes than the limit, or vertices of meshes before they are
// welded, at once; everything else takes time and memory in proportion to them and to the triangles. A repair
// adds at most as many nodes as the limit allows. Adds what was repaired to `repairs`, one element per cloth.
// Throws model::Cancelled.
[[nodiscard]] Result<model::Scene> toScene(const v1::Scene& message, const MeshReader& readMesh = {},
                                           const SceneLimits& most = {},
                                           std::vector<v1::MeshRepair>* repairs = nullptr);

// Sets every field, defaults included, and writes whole meshes. toScene() of the result returns the same
// scene.
v1::Scene toMessage(const model::Scene& scene);
// Like toMessage(), but meshes are empty, and skins of cloths name their colliders only.
v1::Scene toMessageWithoutMeshes(const model::Scene& scene);
v1::Normals toMessage(model::Normals normals);
// All parameters of environment and cloths as one change. `areas` are the areas of the cloths in m²; a cloth
// with a missing area or 0 gets no areal mass.
v1::ParameterChange allParameters(const v1::Scene& scene, std::span<const double> areas);
// `change` with everything that its materials set, as it is in `changed`, the scene after the change: clients
// do not know the numbers of materials. Names single cloths only where they differ from the others. If that
// would make more than limits::kMaxCloths elements, each cloth is named once.
v1::ParameterChange withMaterials(v1::ParameterChange change, const model::Scene& changed);
// Applies a change to the result of allParameters(), as model::applyChange() applies it to a scene. Safe for
// any messages: fields that this release does not know are kept, and changes of unknown cloths and of
// colliders are ignored.
void applyChange(const v1::ParameterChange& change, v1::ParameterChange& all);
// Merges `next` into `earlier`: one change with the same effect as the two, one after the other. The result
// names each cloth and collider once. Safe for any messages; fields that this release does not know are kept.
void mergeChange(const v1::ParameterChange& next, v1::ParameterChange& earlier);

// Error text if the solver of a cloth cannot be used in this scene; nullopt if it can.
std::optional<std::string> unfitSolver(const model::Scene& scene, const model::Cloth& cloth);

// Error text if the dihedral bending of the scene's cloths cannot be used; nullopt if it can.
std::optional<std::string> unfitBending(const model::Scene& scene);

// Error text if the cloth has a pressure that it cannot have in this scene; nullopt if it may.
std::optional<std::string> unfitPressure(const model::Scene& scene, const model::Cloth& cloth);

// Error text if the coarse correction of a cloth cannot be used in this scene; nullopt if it can.
std::optional<std::string> unfitCoarse(const model::Scene& scene, const model::Cloth& cloth);

// Error text if the integrator is not stable with the scene's substeps; nullopt if it is. `bound` is of this
// scene before any change of its parameters.
std::optional<std::string> instability(const model::Scene& scene, const model::StabilityBound& bound);

// Says that cloth is where the stream cannot hold it.
std::string outOfReach(const model::Scene& scene);

}  // namespace clothstream::messages
