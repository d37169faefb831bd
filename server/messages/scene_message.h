// SPDX-License-Identifier: MIT
// Scenes between their message and the domain.
#pragma once

#include <optional>
#include <string>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/messages/mesh_message.h"
#include "server/messages/validation.h"
#include "server/model/material.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Applies the defaults of scene.proto and checks everything: ranges, names and their uniqueness, pins inside
// their grid, meshes, rates, the number of nodes, and that the integrator is stable with these substeps.
// Meshes may be named as files only where there is a reader.
[[nodiscard]] Result<model::Scene> toScene(const v1::Scene& message, const MeshReader& readMesh = {});

// Every field set, defaults too, meshes in full. toScene() of it gives the scene back.
v1::Scene toMessage(const model::Scene& scene);
// But for the meshes, which are there and empty.
v1::Scene toMessageWithoutMeshes(const model::Scene& scene);
v1::Normals toMessage(model::Normals normals);
// What can be changed of environment and cloths, as the message has it. `areas`: m², a cloth; of those that
// it has no area of, or 0, the areal mass is left out.
v1::ParameterChange allParameters(const v1::Scene& scene, std::span<const double> areas);

// The solver that a cloth names; what a cloth of this scene must be for it, unfitSolver() says.
model::Solver toSolver(Checks& checks, const Path& path, const v1::Solver& message);
v1::Solver toMessage(const model::Solver& solver);
// What stands in Environment and in ParameterChange alike.
model::Gust toGust(Checks& checks, const Path& path, const v1::Gust& message);
void write(const model::Gust& gust, v1::Gust& message);

// The radius of a cloth's balls in self-collision, m.
float toBallRadius(Checks& checks, const Path& path, float value, const model::Cloth& cloth);

// nullptr, and the check failed with the names that there are: none of this name.
const model::Material* toMaterial(Checks& checks, const Path& path, const std::string& name);

// What to say of a cloth whose solver cannot serve it in this scene; nullopt if it can.
std::optional<std::string> unfitSolver(const model::Scene& scene, const model::Cloth& cloth);

// What to say of the dihedral bending of a scene's cloths where it cannot be; nullopt if it can.
std::optional<std::string> unfitBending(const model::Scene& scene);

// What to say of a scene whose integrator is not stable with its substeps; nullopt if it is.
std::optional<std::string> instability(const model::Scene& scene);

}  // namespace clothstream::messages
