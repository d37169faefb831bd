// SPDX-License-Identifier: MIT
// Keeps the shown cloth in front of this participant's hand while the server's answer is under way
// (cs_set_local_contact in core.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/core/touch/capsule_boxes.h"
#include "clients/core/touch/own_capsules.h"
#include "clients/core/touch/vector.h"
#include "clients/core/wire/description.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {

// The played cloth has answered to the capsules as they were a round trip and the delay of play-out ago. What
// they have swept since then, they carry before them. Vertices around it follow, so that the cloth slopes by
// at most kSlope. The correction follows from the played positions and the two poses, so it ends when the
// answer is there. It changes by at most the way of the capsules plus kBlendSpeed.
class Contact {
 public:
  // Starts with the cloths of this description.
  void begin(const Description& description);
  // Returns the positions to show at this time for these played positions, which have answered to the
  // capsules `answered`, while the newest ones are `newest`. Times grow from call to call. The result is
  // `played` if nothing is corrected, and valid until the next call.
  std::span<const float> apply(std::span<const float> played, const OwnCapsules& answered,
                               const OwnCapsules& newest, std::uint64_t nowUs);

  // Unit normals of the result, 3 floats per vertex. The first call after apply() computes them.
  std::span<const float> normals(const codec::StreamLayout& layout);
  // Length of the largest correction of the last apply(), m.
  float largest() const { return largest_; }

 private:
  // Change of the correction from vertex to vertex, per length of their edge.
  static constexpr float kSlope = 0.3f;
  static constexpr float kBlendSpeed = 0.35f;  // m/s

  struct Edge {
    std::uint32_t to = 0;
    float length = 0;  // at rest, m
  };

  // Distance from a capsule's segment at which a vertex keeps the triangles around it outside of the capsule.
  float keptDistance(float radius, std::uint32_t vertex) const;
  // Fills the boxes below.
  void box();
  // Largest correction by a capsule that sweeps over the vertex; 0 if none does.
  Vector swept(std::uint32_t vertex, const Vector& played) const;
  void correct(std::uint32_t vertex, const Vector& correction);
  // Limits the change since the last call, m.
  void blend(float most);
  void spread();
  Vector keptOutside(std::uint32_t vertex, const Vector& shown) const;

  std::vector<float> reach_;  // per vertex: farthest that a point of its triangles is from a vertex, m
  float farthestReach_ = 0;
  std::vector<std::uint32_t> firstEdge_;  // per vertex, and the end
  std::vector<Edge> edges_;
  OwnCapsules answered_, now_;  // of the last apply()
  CapsuleBoxes sweeps_;         // what the capsules that have moved can sweep
  CapsuleBoxes ends_;           // what the newest capsules keep the cloth out of
  std::uint64_t shownUs_ = 0;
  std::vector<Vector> corrections_;
  std::vector<float> sizes_;              // lengths of the corrections
  std::vector<std::uint32_t> corrected_;  // vertices whose correction is not 0
  std::vector<Vector> lastCorrections_;
  std::vector<std::uint32_t> lastCorrected_;
  std::vector<std::vector<std::uint32_t>> buckets_;  // of spread(); empty between calls
  std::vector<float> shown_, normals_;
  bool hasNormals_ = false;
  float largest_ = 0;
};

}  // namespace clothstream::client
