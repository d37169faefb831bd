// SPDX-License-Identifier: MIT
// Converts closed triangle meshes of colliders between messages and the model.
#pragma once

#include <cstddef>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/mesh_message.h"
#include "server/messages/validation.h"
#include "server/model/collider.h"

namespace clothstream::messages {

// Null if the checks fail. Refuses a file name if there is no reader.
model::Solid toSolid(Checks& checks, const Path& path, const v1::ColliderMesh& message,
                     const MeshReader& readMesh);

void write(const model::ClosedMesh& mesh, v1::ColliderMesh& message);
// As little-endian bytes, for a description.
void write(const model::ClosedMesh& mesh, v1::ColliderMeshDescription& message);

// Bytes of a description's positions and triangles.
std::size_t geometryBytes(const model::ClosedMesh& mesh);

}  // namespace clothstream::messages
