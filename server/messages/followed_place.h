// SPDX-License-Identifier: MIT
// Bounds on the places of colliders and attachments that cloth follows.
#pragma once

#include <string>

#include "server/messages/validation.h"
#include "server/model/pose.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Cloth that leaves the range of the stream takes the scene back for everyone, and out of it again as long as
// what it follows is out there. So what cloth follows may be at most half of the range away from the origin
// of the scene, along each axis. The other half is for joints relative to their collider, and for the cloth.
float mostFollowedDistance(const model::Scene& scene);

// Whether cloth follows the collider, by its joints or by an attachment.
bool isFollowed(const model::Scene& scene, const std::string& collider);

// Checks a place of something that cloth follows. `start` is its place in the scene as it was accepted, from
// whose distance nothing is refused.
void checkFollowedPlace(Checks& checks, const Path& path, const model::Vec3& place, const model::Vec3& start,
                        const model::Scene& scene);

}  // namespace clothstream::messages
