// SPDX-License-Identifier: MIT
// Tracked hands, as the capsules that cloth collides with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/messages/validation.h"
#include "server/model/input.h"

namespace clothstream::messages {

// Capsules of a hand: the thumb's three bones, each finger's four, of which the first lies in the palm, and
// one from the wrist to the middle finger.
inline constexpr std::size_t kHandBones = 20;
// Ids of a hand's bones begin here, 32 apart for the second side.
inline constexpr std::uint32_t kFirstBoneId = 0x80000000;

// kHandBones capsules, each between two joints with the mean of their radii, in the order of
// docs/protocol.md. Refuses what is no hand: another number of joints than 26 or 25, numbers out of range,
// joints too far from the wrist. Empty if so.
[[nodiscard]] std::vector<model::ParticipantCollider> toBones(Checks& checks, const Path& path,
                                                              const v1::HandJoints& message);

}  // namespace clothstream::messages
