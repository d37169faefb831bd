// SPDX-License-Identifier: MIT
#include "clients/core/touch/contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/codec/vertex_normals.h"

namespace clothstream::client {
namespace {

// Ways that count, m. A longer one is a jump.
constexpr float kShortestWay = 1e-3f, kLongestWay = 3;

// The part of a sweep that is behind the capsule begins this far back, in units of its kept distance.
constexpr float kBehind = 0.2f;
// Above the root of 1 + kBehind * kBehind, so that a box of this many kept distances has the whole sweep.
constexpr float kSweepMargin = 1.03f;

constexpr float kBucket = 5e-4f, kLeast = 1e-5f;  // m

// Part of the segment whose ball is nearest to a point.
float nearestPart(const Capsule& capsule, const Vector& point) {
  const Vector along = capsule.to - capsule.from;
  const float squared = dot(along, along);
  const float level = squared > 0 ? dot(along, point - capsule.from) / squared : 0;
  if (capsule.growth == 0) return std::clamp(level, 0.0f, 1.0f);
  // The larger end ball contains the other.
  const float slopeSquared = squared - capsule.growth * capsule.growth;
  if (!(slopeSquared > 0)) return capsule.growth > 0 ? 1 : 0;
  const float distance = length(point - capsule.from - level * along);
  const float tilt = capsule.growth / std::sqrt(slopeSquared);
  return std::clamp(level + tilt * distance / std::sqrt(squared), 0.0f, 1.0f);
}

// Any vector of length 1 across another one.
Vector across(const Vector& vector) {
  const Vector axis = std::abs(vector.y) < 0.9f * length(vector) ? Vector{0, 1, 0} : Vector{1, 0, 0};
  const Vector found = cross(vector, axis);
  const float size = length(found);
  return size > 0 ? (1 / size) * found : Vector{0, 1, 0};
}

// Direction from the segment to a point; a direction across the segment for a point on it.
Vector sideOf(const Capsule& capsule, const Vector& fromSegment, float distance) {
  return distance > 1e-6f ? (1 / distance) * fromSegment : across(capsule.to - capsule.from);
}

Vector withoutPart(const Vector& vector, const Vector& direction) {
  return vector - dot(vector, direction) * direction;
}

// The longer way of the two ends.
float longestWay(const Capsule& from, const Capsule& to) {
  return std::max(length(to.from - from.from), length(to.to - from.to));
}

float travel(const OwnCapsules& from, const OwnCapsules& to) {
  float longest = 0;
  for (std::size_t i = 0; i < kOwnCapsules; ++i)
    if (from[i].present() && to[i].present()) longest = std::max(longest, longestWay(from[i], to[i]));
  return longest;
}

// 0 below `from`, 1 above `to`, linear between them.
float ramp(float value, float from, float to) {
  return std::clamp((value - from) / (to - from), 0.0f, 1.0f);
}

}  // namespace

void Contact::begin(const Description& description) {
  const std::vector<std::uint32_t>& triangles = description.triangles;
  const std::size_t vertices = description.restPositions.size() / 3;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;
  ends.reserve(2 * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); i += 3)
    for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {2, 0}}) {
      const std::uint32_t from = triangles[i + static_cast<std::size_t>(a)];
      const std::uint32_t to = triangles[i + static_cast<std::size_t>(b)];
      ends.emplace_back(from, to);
      ends.emplace_back(to, from);
    }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());

  *this = {};
  reach_.assign(vertices, 0);
  firstEdge_.assign(vertices + 1, 0);
  edges_.reserve(ends.size());
  for (const auto& [from, to] : ends) {
    const float size = length(vectorAt(description.restPositions.data(), from) -
                              vectorAt(description.restPositions.data(), to));
    // No point of a triangle is farther from its nearest corner than the longest edge over the root of three.
    reach_[from] = std::max(reach_[from], size / std::sqrt(3.0f));
    edges_.push_back({to, size});
    ++firstEdge_[from + 1];
  }
  if (!reach_.empty()) farthestReach_ = *std::max_element(reach_.begin(), reach_.end());
  for (std::size_t i = 0; i < vertices; ++i) firstEdge_[i + 1] += firstEdge_[i];
  corrections_.assign(vertices, {});
  lastCorrections_.assign(vertices, {});
  sizes_.assign(vertices, 0);
}

std::span<const float> Contact::apply(std::span<const float> played, const OwnCapsules& answered,
                                      const OwnCapsules& newest, std::uint64_t nowUs) {
  largest_ = 0;
  if (played.size() != 3 * reach_.size()) return played;
  const float seconds = nowUs > shownUs_ ? static_cast<float>(nowUs - shownUs_) * 1e-6f : 0;
  const float most = std::max(travel(now_, newest), travel(answered_, answered)) + kBlendSpeed * seconds;
  shownUs_ = nowUs;
  hasNormals_ = false;
  now_ = newest;
  answered_ = answered;
  lastCorrections_.swap(corrections_);
  lastCorrected_.swap(corrected_);
  for (const std::uint32_t vertex : corrected_) corrections_[vertex] = {};
  for (const std::uint32_t vertex : lastCorrected_) sizes_[vertex] = 0;
  corrected_.clear();

  box();
  if (ends_.empty() && lastCorrected_.empty()) return played;
  for (std::uint32_t vertex = 0; vertex < reach_.size(); ++vertex) {
    const Vector correction = swept(vertex, vectorAt(played.data(), vertex));
    if (dot(correction, correction) > 0) correct(vertex, correction);
  }
  spread();
  // Vertices that the others took with them may have come into a capsule.
  for (std::uint32_t vertex = 0; vertex < reach_.size(); ++vertex) {
    const Vector at = vectorAt(played.data(), vertex) + corrections_[vertex];
    const Vector push = keptOutside(vertex, at) - at;
    if (dot(push, push) > 0) correct(vertex, corrections_[vertex] + push);
  }
  blend(most);
  shown_.assign(played.begin(), played.end());
  for (const std::uint32_t vertex : corrected_) {
    const Vector at = vectorAt(played.data(), vertex) + corrections_[vertex];
    shown_[3 * vertex] = at.x;
    shown_[3 * vertex + 1] = at.y;
    shown_[3 * vertex + 2] = at.z;
    largest_ = std::max(largest_, sizes_[vertex]);
  }
  return largest_ > 0 ? std::span<const float>(shown_) : played;
}

std::span<const float> Contact::normals(const codec::StreamLayout& layout) {
  if (!std::exchange(hasNormals_, true)) {
    normals_.resize(shown_.size());
    codec::computeVertexNormals(layout, shown_.data(), normals_.data());
  }
  return normals_;
}

float Contact::keptDistance(float radius, std::uint32_t vertex) const {
  return std::sqrt(radius * radius + reach_[vertex] * reach_[vertex]);
}

void Contact::box() {
  sweeps_.clear();
  ends_.clear();
  for (std::size_t i = 0; i < kOwnCapsules; ++i) {
    const Capsule& start = answered_[i];
    const Capsule& end = now_[i];
    if (!end.present()) continue;
    const float reach = end.largestRadius() + farthestReach_ + kLeast;
    Box box;
    box.add(end, reach);
    ends_.add(i, box);
    if (!start.present() || longestWay(start, end) < 0.99f * kShortestWay) continue;
    Box sweep;
    sweep.add(start, kSweepMargin * reach);
    sweep.add(end, kSweepMargin * reach);
    sweeps_.add(i, sweep);
  }
}

Vector Contact::swept(std::uint32_t vertex, const Vector& played) const {
  Vector largest;
  float largestSize = 0;
  sweeps_.around(played, [&](std::size_t i) {
    const Capsule& start = answered_[i];
    const Capsule& end = now_[i];
    // The point of the segment that comes nearest to the vertex on its way.
    float part = nearestPart(start, played), gone = 0;
    Vector from, way;
    for (int round = 0; round < 3; ++round) {
      from = start.at(part);
      way = end.at(part) - from;
      gone = length(way);
      if (!(gone > kShortestWay && gone < kLongestWay) || round == 2) break;
      const float progress = std::clamp(dot(played - from, way) / (gone * gone), 0.0f, 1.0f);
      part = nearestPart({start.from + progress * (end.from - start.from),
                          start.to + progress * (end.to - start.to), end.radius, end.growth},
                         played);
    }
    if (!(gone > kShortestWay && gone < kLongestWay)) return;
    const float kept = keptDistance(end.radiusAt(part), vertex);
    const Vector direction = (1 / gone) * way;
    const float along = dot(played - from, direction);
    const float beside = length(withoutPart(played - from, direction));
    if (!(beside < kept)) return;
    const float front = gone + std::sqrt(kept * kept - beside * beside);
    // Not what is behind the capsule, and less at the rim of what it sweeps, so that nothing jumps there.
    const float share = ramp(along, -kBehind * kept, 0.3f * kept) * ramp(kept - beside, 0, 0.3f * kept);
    const float size = share * (front - along);
    if (!(size > largestSize && size < kLongestWay)) return;
    largestSize = size;
    largest = size * direction;
  });
  return largest;
}

void Contact::correct(std::uint32_t vertex, const Vector& correction) {
  if (sizes_[vertex] == 0) corrected_.push_back(vertex);
  corrections_[vertex] = correction;
  sizes_[vertex] = length(correction);
}

// Goes from large corrections to small ones, as Dijkstra's algorithm does, in buckets of kBucket. A vertex
// that grows within its bucket is taken again.
void Contact::spread() {
  const auto bucketOf = [&](std::uint32_t vertex) {
    return static_cast<std::size_t>(sizes_[vertex] / kBucket);
  };
  const auto put = [&](std::uint32_t vertex) {
    const std::size_t bucket = bucketOf(vertex);
    if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
    buckets_[bucket].push_back(vertex);
  };
  for (const std::uint32_t vertex : corrected_) put(vertex);
  for (std::size_t bucket = buckets_.size(); bucket-- > 0;) {
    for (std::size_t i = 0; i < buckets_[bucket].size(); ++i) {
      const std::uint32_t vertex = buckets_[bucket][i];
      if (bucketOf(vertex) != bucket) continue;
      const float size = sizes_[vertex];
      for (std::uint32_t edge = firstEdge_[vertex]; edge < firstEdge_[vertex + 1]; ++edge) {
        const float left = size - kSlope * edges_[edge].length;
        const std::uint32_t to = edges_[edge].to;
        if (!(left > sizes_[to] + kLeast)) continue;
        correct(to, (left / size) * corrections_[vertex]);
        put(to);
      }
    }
    buckets_[bucket].clear();
  }
}

void Contact::blend(float most) {
  const auto limit = [&](std::uint32_t vertex) {
    const Vector change = corrections_[vertex] - lastCorrections_[vertex];
    if (const float size = length(change); size > most)
      correct(vertex, lastCorrections_[vertex] + (most / size) * change);
  };
  for (const std::uint32_t vertex : lastCorrected_) limit(vertex);
  for (std::size_t i = 0; i < corrected_.size(); ++i) limit(corrected_[i]);
}

// The second round repairs what the first one pushed from one capsule into another. A corrected vertex goes
// on in its direction, so that it stays on the side of those around it.
Vector Contact::keptOutside(std::uint32_t vertex, const Vector& shown) const {
  Vector at = shown;
  bool isMoved = true;
  for (int round = 0; round < 2 && isMoved; ++round) {
    isMoved = false;
    ends_.around(at, [&](std::size_t i) {
      const Capsule& capsule = now_[i];
      const float part = nearestPart(capsule, at);
      const Vector nearest = capsule.at(part);
      const Vector away = at - nearest;
      const float kept = keptDistance(capsule.radiusAt(part), vertex), distance = length(away);
      if (!(distance < kept)) return;
      const Vector side =
          sizes_[vertex] > 0 ? (1 / sizes_[vertex]) * corrections_[vertex] : sideOf(capsule, away, distance);
      const Vector beside = withoutPart(away, side);
      at = nearest + beside + std::sqrt(std::max(0.0f, kept * kept - dot(beside, beside))) * side;
      isMoved = true;
    });
  }
  return at;
}

}  // namespace clothstream::client
