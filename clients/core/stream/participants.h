// SPDX-License-Identifier: MIT
// The participants of the joined scene.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "clients/core/wire/server_message.h"

namespace clothstream::client {

class Participants {
 public:
  void begin(std::vector<Participant> all) { all_ = std::move(all); }
  // Someone came, changed or left. Those beyond `most` are left out.
  void change(Presence presence, std::size_t most) {
    newest_ = std::move(presence);
    const Participant& who = newest_.participant;
    const auto known =
        std::find_if(all_.begin(), all_.end(), [&](const Participant& one) { return one.id == who.id; });
    if (newest_.kind == CS_PRESENCE_LEFT) {
      if (known != all_.end()) all_.erase(known);
    } else if (known != all_.end()) {
      *known = who;
    } else if (all_.size() < most) {
      all_.push_back(who);
    }
  }

  const std::vector<Participant>& all() const { return all_; }
  // Name of the collider that a participant wears; empty for none.
  const std::string& bodyOf(std::uint64_t id) const {
    static const std::string none;
    const auto known =
        std::find_if(all_.begin(), all_.end(), [&](const Participant& one) { return one.id == id; });
    return known == all_.end() ? none : known->body;
  }
  // The newest change; kind 0 before the first.
  const Presence& newest() const { return newest_; }

 private:
  std::vector<Participant> all_;
  Presence newest_;
};

}  // namespace clothstream::client
