// SPDX-License-Identifier: MIT
// Converts joints of meshes between messages and the model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <google/protobuf/repeated_field.h>

#include "clothstream/v1/scene.pb.h"
#include "server/messages/validation.h"
#include "server/model/skin.h"

namespace clothstream::messages {

// Skin of a mesh of `vertexCount` vertices. `sources` are the indices of the vertices that the mesh kept.
// Absent if the checks fail.
std::optional<model::Skin> toSkin(Checks& checks, const Path& path, const v1::Skin& message,
                                  std::size_t vertexCount, std::span<const std::uint32_t> sources);

// The four joints of a vertex, from lists with four numbers for each vertex. Weights whose sum is 1 within
// 0.01 are normalised.
model::VertexJoints toVertexJoints(Checks& checks, const Path& path,
                                   const google::protobuf::RepeatedField<std::uint32_t>& indices,
                                   const google::protobuf::RepeatedField<float>& weights, std::size_t vertex,
                                   std::size_t jointCount);

// Poses of all joints, relative to their parents.
std::vector<model::Pose> toJoints(Checks& checks, const Path& path,
                                  const google::protobuf::RepeatedPtrField<v1::Pose>& message,
                                  std::size_t jointCount);

void write(const model::Skin& skin, v1::Skin& message);

// Poses of all joints in the frame of the collider, seven numbers each: position, then quaternion x, y, z, w.
// `local` are the poses relative to the parents.
void writeJoints(const model::Skin& skin, std::span<const model::Pose> local,
                 google::protobuf::RepeatedField<float>& numbers);
// The same for poses that are in the frame of the collider already.
void writePoses(std::span<const model::Pose> poses, google::protobuf::RepeatedField<float>& numbers);

}  // namespace clothstream::messages
