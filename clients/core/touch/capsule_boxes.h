// SPDX-License-Identifier: MIT
// Boxes around capsules, which tell quickly which capsules a point can touch.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/touch/own_capsules.h"
#include "clients/core/touch/vector.h"

namespace clothstream::client {

// Smallest box around what was added. It contains nothing at first.
class Box {
 public:
  void add(const Vector& point, float margin) {
    least_ = {std::min(least_.x, point.x - margin), std::min(least_.y, point.y - margin),
              std::min(least_.z, point.z - margin)};
    most_ = {std::max(most_.x, point.x + margin), std::max(most_.y, point.y + margin),
             std::max(most_.z, point.z + margin)};
  }
  void add(const Capsule& capsule, float margin) {
    add(capsule.from, margin);
    add(capsule.to, margin);
  }
  void add(const Box& box) {
    add(box.least_, 0);
    add(box.most_, 0);
  }
  bool contains(const Vector& point) const {
    return point.x >= least_.x && point.x <= most_.x && point.y >= least_.y && point.y <= most_.y &&
           point.z >= least_.z && point.z <= most_.z;
  }

 private:
  static constexpr float kFar = std::numeric_limits<float>::max();

  Vector least_{kFar, kFar, kFar}, most_{-kFar, -kFar, -kFar};
};

// Boxes of three levels: all capsules, groups of those that were added one after the other, and each capsule.
class CapsuleBoxes {
 public:
  void clear() {
    all_ = {};
    groups_.clear();
    boxes_.clear();
  }
  bool empty() const { return boxes_.empty(); }
  void add(std::size_t capsule, const Box& box) {
    if (boxes_.size() % kGroup == 0) groups_.emplace_back();
    all_.add(box);
    groups_.back().add(box);
    boxes_.push_back({capsule, box});
  }
  // Calls use(capsule) for each capsule in whose box the point is, in the order of add(). `use` may move the
  // point. The capsules after it then see the new one, as long as it stays in the box of their group.
  template <typename Use>
  void around(const Vector& point, const Use& use) const {
    if (!all_.contains(point)) return;
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      if (!groups_[group].contains(point)) continue;
      const std::size_t end = std::min(boxes_.size(), (group + 1) * kGroup);
      for (std::size_t i = group * kGroup; i < end; ++i)
        if (boxes_[i].box.contains(point)) use(boxes_[i].capsule);
    }
  }

 private:
  static constexpr std::size_t kGroup = CS_HAND_BONES;

  struct Boxed {
    std::size_t capsule = 0;
    Box box;
  };
  Box all_;
  std::vector<Box> groups_;
  std::vector<Boxed> boxes_;
};

}  // namespace clothstream::client
