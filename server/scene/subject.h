// SPDX-License-Identifier: MIT
// The person or program behind a token.
#pragma once

#include <compare>
#include <string>

namespace clothstream::scene {

// Equal names of two tenants are different subjects. Bans, resume tokens and limits compare both parts.
struct Subject {
  std::string tenant;  // may be empty
  std::string name;    // empty: the peer has no subject, because it has sent no token

  bool empty() const { return name.empty(); }
  friend auto operator<=>(const Subject&, const Subject&) = default;
};

}  // namespace clothstream::scene
