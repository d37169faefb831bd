// SPDX-License-Identifier: MIT
// Colliders of this participant as capsules, for contact.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "clients/core/core.h"
#include "clients/core/touch/vector.h"
#include "clients/core/wire/client_message.h"

namespace clothstream::client {

// Convex hull of the balls about the ends of a segment, m. The radius is negative if the participant has no
// such capsule.
struct Capsule {
  Vector from, to;
  float radius = -1;  // at `from`
  float growth = 0;   // of the radius, up to `to`

  bool present() const { return radius >= 0; }
  float largestRadius() const { return growth > 0 ? radius + growth : radius; }
  float radiusAt(float part) const { return radius + part * growth; }
  // Point of the segment; 0 is `from` and 1 is `to`.
  Vector at(float part) const { return from + part * (to - from); }
};

// Spheres and capsules by their index, then the bones of the left and of the right hand, then the head: the
// order of their ids, which frames have too. A box is left out.
inline constexpr std::size_t kOwnCapsules = CS_MAX_COLLIDERS + 2 * CS_HAND_BONES + 1;
using OwnCapsules = std::array<Capsule, kOwnCapsules>;

OwnCapsules ownCapsules(const Poses& poses);

// The capsules of this participant in a frame, by the order and the sizes of those that were sent, `sent`.
// Returns nullopt if they are not the same.
std::optional<OwnCapsules> capsulesOf(std::span<const Collider> frame, std::uint64_t participantId,
                                      const OwnCapsules& sent);

// The capsules of the last two seconds, at most 512 of them.
class CapsuleHistory {
 public:
  // Times ascend. A pose that is not later than the one before replaces it.
  void add(const OwnCapsules& capsules, std::uint64_t timeUs);
  bool empty() const { return poses_.empty(); }
  const OwnCapsules& newest() const { return poses_.back().capsules; }
  // Between two poses the capsules move in a straight line. Only those that are in both are present then.
  OwnCapsules at(std::uint64_t timeUs) const;

 private:
  static constexpr std::uint64_t kLongestUs = 2'000'000;
  static constexpr std::size_t kMost = 512;

  struct Posed {
    std::uint64_t timeUs = 0;
    OwnCapsules capsules;
  };
  std::deque<Posed> poses_;
};

}  // namespace clothstream::client
