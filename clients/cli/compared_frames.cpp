// SPDX-License-Identifier: MIT
// Decodes both recordings side by side and measures the distance of each vertex.
#include "clients/cli/compared_frames.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "clients/cli/message_difference.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/recording/played_recording.h"
#include "proto/codec/reach.h"
#include "proto/recording/recorded_description.h"

namespace clothstream::cli {
namespace {

using client::PlayedRecording;
using recording::CutFiles;
using recording::RecordingReader;

constexpr std::size_t kMaxDamages = 16;

// Frames of one recording. Parts that cannot be read are noted and passed.
class Frames {
 public:
  Frames(PlayedRecording played, std::vector<std::string>& damaged)
      : played_(std::move(played)), damaged_(damaged) {}

  // Continues to the next frame. Returns false at the end, after a note that counts all frames with faults.
  bool next() {
    for (;;) {
      const auto message = played_.next(CS_RECORDED_FRAME);
      if (message && !*message) return end();
      if (message &&
          frame_.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size()))) {
        tick_ = (*message)->tick;
        return true;
      }
      if (damaged_.size() < kMaxDamages)
        damaged_.push_back(message ? "a frame cannot be read" : message.error());
      if (cs_get_state(client()) == CS_STATE_FAILED) return end();
    }
  }

  std::uint64_t tick() const { return tick_; }
  double seconds() const { return played_.seconds(); }
  const cs_client* client() const { return played_.client(); }
  const v1::Frame& frame() const { return frame_; }
  const RecordingReader& reader() const { return played_.reader(); }

 private:
  bool end() {
    if (std::string faults = played_.faults().text(); !faults.empty()) damaged_.push_back(std::move(faults));
    return false;
  }

  PlayedRecording played_;
  v1::Frame frame_;
  std::vector<std::string>& damaged_;
  std::uint64_t tick_ = 0;
};

tl::expected<Frames, Error> open(const std::string& path, const recording::ReadLimits& limits,
                                 double& maxError, std::vector<std::string>& damaged) {
  auto reader = orError(kUnreadable, RecordingReader::open(path, CutFiles::read, limits));
  if (!reader) return tl::unexpected(reader.error());
  if (!reader->mcap().indexed()) damaged.emplace_back("its end is missing or damaged");
  if (const auto checked = reader->check(); !checked && damaged.empty()) damaged.push_back(checked.error());
  const auto description = orError(kUnreadable, recording::readDescription(*reader));
  if (!description) return tl::unexpected(description.error());
  maxError = double{description->max_error()};
  auto played = PlayedRecording::open(std::move(*reader));
  if (!played) return makeError(kUnreadable, "{}: {}", path, played.error());
  return Frames(std::move(*played), damaged);
}

// The error says how the cloths differ.
tl::expected<void, Error> haveTheSameCloths(const Frames& a, const Frames& b) {
  const auto differ = [](const std::string& how) {
    return makeError(kUnreadable, "the recordings show different cloths, so they cannot be compared: {}",
                     how);
  };
  const std::uint32_t cloths = cs_cloth_count(a.client());
  if (cloths != cs_cloth_count(b.client()))
    return differ(fmt::format("{} and {} cloths", cloths, cs_cloth_count(b.client())));
  for (std::uint32_t i = 0; i < cloths; ++i) {
    cs_cloth one, other;
    cs_get_cloth(a.client(), i, &one);
    cs_get_cloth(b.client(), i, &other);
    if (one.vertex_count != other.vertex_count)
      return differ(fmt::format("cloth {} has {} and {} vertices", i, one.vertex_count, other.vertex_count));
  }
  return {};
}

// Distances of the vertices of one tick.
struct Distances {
  double largest = 0, sum = 0;
  std::uint32_t vertex = 0;  // of the largest distance
};

Distances distancesOf(const cs_client* a, const cs_client* b) {
  const float* const was = cs_positions(a);
  const float* const is = cs_positions(b);
  const std::uint32_t vertices = cs_vertex_count(a);
  Distances distances;
  if (std::memcmp(was, is, std::size_t{vertices} * 3 * sizeof(float)) == 0) return distances;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const auto along = [&](std::size_t axis) {
      return double{is[3 * std::size_t{i} + axis]} - double{was[3 * std::size_t{i} + axis]};
    };
    const double distance = std::hypot(along(0), along(1), along(2));
    distances.sum += distance;
    if (distance > distances.largest) {
      distances.largest = distance;
      distances.vertex = i;
    }
  }
  return distances;
}

VertexDistance placeOf(const Frames& frames, const Distances& distances) {
  VertexDistance place;
  place.tick = frames.tick();
  place.seconds = frames.seconds();
  place.metres = distances.largest;
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(frames.client(), i, &cloth) != 0; ++i) {
    if (distances.vertex < cloth.first_vertex || distances.vertex - cloth.first_vertex >= cloth.vertex_count)
      continue;
    place.cloth = cloth.name;
    place.vertex = distances.vertex - cloth.first_vertex;
  }
  return place;
}

// True if both recordings know the hash of the exact state, and it differs. Recordings that were imported do
// not know it.
bool statesDiffer(const v1::Frame& a, const v1::Frame& b) {
  return a.state_hash() != 0 && b.state_hash() != 0 && a.state_hash() != b.state_hash();
}

class Comparison {
 public:
  explicit Comparison(ComparedFrames& result) : result_(result) {}

  void add(const Frames& a, const Frames& b) {
    ++result_.common;
    const Distances distances = distancesOf(a.client(), b.client());
    sum_ += distances.sum;
    vertices_ = cs_vertex_count(a.client());
    for (const auto& [farthest, client] :
         {std::pair(&result_.farthest[0], a.client()), std::pair(&result_.farthest[1], b.client())})
      *farthest = std::max(*farthest, codec::farthestOf({cs_positions(client), 3 * vertices_}));
    if (distances.largest > result_.largest.metres) result_.largest = placeOf(a, distances);
    if (distances.largest > 0 || statesDiffer(a.frame(), b.frame())) {
      ++result_.different;
      if (!result_.firstDifferent) {
        result_.firstDifferent = a.tick();
        result_.first = placeOf(a, distances);
      }
    }
    if (!result_.firstCollider) compareColliders(a, b);
  }

  void finish() {
    const double count = static_cast<double>(result_.common) * static_cast<double>(vertices_);
    if (count > 0) result_.mean = sum_ / count;
  }

 private:
  void compareColliders(const Frames& a, const Frames& b) {
    const auto only = [](const v1::Frame& frame) {
      v1::Frame colliders;
      *colliders.mutable_colliders() = frame.colliders();
      return colliders;
    };
    std::string difference = differenceOf(only(a.frame()), only(b.frame()));
    if (difference.empty()) return;
    result_.firstCollider = a.tick();
    result_.collider = std::move(difference);
  }

  ComparedFrames& result_;
  double sum_ = 0;
  std::size_t vertices_ = 0;
};

}  // namespace

tl::expected<ComparedFrames, Error> compareFrames(const std::array<std::string, 2>& paths,
                                                  const recording::ReadLimits& limits) {
  ComparedFrames result;
  auto a = open(paths[0], limits, result.maxError[0], result.damaged[0]);
  if (!a) return tl::unexpected(a.error());
  auto b = open(paths[1], limits, result.maxError[1], result.damaged[1]);
  if (!b) return tl::unexpected(b.error());
  if (auto same = haveTheSameCloths(*a, *b); !same) return tl::unexpected(same.error());
  const double length = static_cast<double>(a->reader().end() - a->reader().start()) * 1e-9;
  Progress progress("compare", static_cast<std::uint32_t>(std::min(length, 1e9)));
  Comparison comparison(result);
  bool moreA = a->next(), moreB = b->next();
  while (moreA || moreB) {
    if (interrupted()) return makeError(kFailed, "interrupted");
    const bool takesA = moreA && (!moreB || a->tick() <= b->tick());
    const bool takesB = moreB && (!moreA || b->tick() <= a->tick());
    if (takesA && takesB)
      comparison.add(*a, *b);
    else
      ++result.only[takesA ? 0 : 1];
    if (takesA) {
      progress.show(static_cast<std::uint32_t>(a->seconds()));
      moreA = a->next();
    }
    if (takesB) moreB = b->next();
  }
  comparison.finish();
  return result;
}

}  // namespace clothstream::cli
