// SPDX-License-Identifier: MIT
// Converts tracked hands to capsules that collide with cloth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/hands/bones.h"
#include "server/messages/validation.h"
#include "server/model/input.h"

namespace clothstream::messages {

// Number of capsules per hand: three bones of the thumb, four of each finger (the first one is in the
// palm), and one from the wrist to the middle finger.
inline constexpr std::size_t kHandBones = hands::kBones.size();
// Id of the first bone of the left hand. Ids of the right hand start 32 higher.
inline constexpr std::uint32_t kFirstBoneId = 0x80000000;

// Returns kHandBones capsules in the order of docs/protocol.md. Each connects two joints and has the mean of
// their radii. Refuses a number of joints other than 26 or 25, numbers out of range, and joints too far from
// the wrist. Then returns an empty vector.
[[nodiscard]] std::vector<model::ParticipantCollider> toBones(Checks& checks, const Path& path,
                                                              const v1::HandJoints& message);

}  // namespace clothstream::messages
