// SPDX-License-Identifier: MIT
// Bounds on the places of colliders and attachments that cloth follows.
#pragma once

#include <string>

#include "server/messages/validation.h"
#include "server/model/pose.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Largest distance, in m along each axis, of what cloth follows from the origin of the scene: half of the
// range of the stream. The other half is for joints relative to their collider, and for the cloth. Cloth
// outside of the range makes the scene go back for everyone, again and again while what it follows stays
// there.
float mostFollowedDistance(const model::Scene& scene);

// Whether cloth follows the collider, by its joints or by an attachment.
bool isFollowed(const model::Scene& scene, const std::string& collider);

// Checks a place of something that cloth follows. `start` is its place in the scene as it was accepted, from
// whose distance nothing is refused.
void checkFollowedPlace(Checks& checks, const Path& path, const model::Vec3& place, const model::Vec3& start,
                        const model::Scene& scene);

}  // namespace clothstream::messages
