// SPDX-License-Identifier: MIT
// Subjects that may not join a scene.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/scene/subject.h"

namespace clothstream::scene {

struct Ban {
  Subject subject;          // of the banned tokens; not empty
  std::string displayName;  // when the ban began, for people; may be empty

  friend bool operator==(const Ban&, const Ban&) = default;
};

// In the order in which the bans began, each subject once. Not thread-safe.
class BanList {
 public:
  static constexpr std::size_t kMax = 256;

  // Returns false if the list is full.
  [[nodiscard]] bool add(Ban ban) {
    if (contains(ban.subject)) return true;
    if (bans_.size() >= kMax) return false;
    bans_.push_back(std::move(ban));
    return true;
  }
  // Lifts the bans of subjects with this name, of every tenant. Returns whether there was one.
  bool lift(std::string_view name) {
    return std::erase_if(bans_, [&](const Ban& ban) { return ban.subject.name == name; }) > 0;
  }
  bool contains(const Subject& subject) const {
    return std::ranges::any_of(bans_, [&](const Ban& ban) { return ban.subject == subject; });
  }

  const std::vector<Ban>& get() const { return bans_; }
  // Replaces the list, for example by one that was saved. Bans beyond kMax are dropped.
  void set(std::vector<Ban> bans) {
    bans_ = std::move(bans);
    if (bans_.size() > kMax) bans_.resize(kMax);
  }

 private:
  std::vector<Ban> bans_;
};

}  // namespace clothstream::scene
