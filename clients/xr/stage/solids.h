// SPDX-License-Identifier: MIT
// Solids of colliders, people, hands and rays.
#pragma once

#include <vector>

#include <clothstream/core.h>

#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

// Colour of a participant, the same for everyone.
Colour colourOf(std::uint64_t participant);

Pose poseOf(const cs_collider& collider);

// Adds a collider of the scene: ceramic spheres, wooden capsules, plaster boxes. Hulls are drawn as meshes.
void addSceneCollider(const cs_collider& collider, std::vector<Solid>& out);
// Adds a collider of a participant, which is red if it yields; a head whose orientation is known has a visor.
void addParticipantCollider(const cs_collider& collider, const Colour& colour, float opacity,
                            std::vector<Solid>& out);
bool isHead(const cs_collider& collider);

// Adds a tracked hand: a tapered capsule for each bone. Each of the 26 joints is {x, y, z, radius}, in the
// order of OpenXR. `hidesOnly`: it hides what is behind it and has no colour, for pass-through.
void addHand(const float* joints, const Colour& colour, bool hidesOnly, std::vector<Solid>& out);
// Adds a capsule from one point to another.
void addRod(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius, float toRadius,
            const Solid& look, std::vector<Solid>& out);
// Adds a thin glowing ray.
void addRay(const Eigen::Vector3f& from, const Eigen::Vector3f& to, const Colour& colour,
            std::vector<Solid>& out);

}  // namespace clothstream::xr
