// SPDX-License-Identifier: MIT
// Converts the binding of a cloth to the joints of a collider.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "clothstream/v1/scene.pb.h"
#include "server/messages/mesh_message.h"
#include "server/messages/validation.h"
#include "server/model/cancellation.h"
#include "server/model/cloth_skin.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Joints and limits of all nodes of the cloth, whose shape, pins and attachments must be set. Null if the
// checks fail.
//
// Joints are those of the message, or else of the file (found by their names), or else of the nearest point
// of the collider. Each limit is that of the last of these that has it: the message's `limits`, the file, the
// message's lists, its regions in their order. Where vertices are one node, it has the joints of the first
// vertex, the smallest of their largest distances, and their backstop with the largest radius; of equal radii
// the nearest. Throws model::Cancelled.
std::shared_ptr<const model::ClothSkin> toClothSkin(Checks& checks, const Path& path,
                                                    const v1::ClothSkin& message,
                                                    const std::vector<model::Collider>& colliders,
                                                    const model::Cloth& cloth, const ClothVertices& vertices,
                                                    const model::Cancellation& cancellation);

// Writes joints and limits of every node. Limits that no node has are left out.
void write(const model::ClothSkin& skin, v1::ClothSkin& message);

}  // namespace clothstream::messages
