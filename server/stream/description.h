// SPDX-License-Identifier: MIT
// Everything that a decoder needs before its first frame, in pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/stream/envelope.h"

namespace clothstream::stream {

// Immutable; shared by all who join while it holds. Geometry is nearly all of it and the same in all
// descriptions of a scene, so who holds one that holds no more costs little.
class Description {
 public:
  // Both serialised StreamDescriptions, each with other fields: the cloths, and all the rest.
  Description(std::uint64_t contentId, std::shared_ptr<const std::string> geometry, std::string rest)
      : contentId_(contentId), geometry_(std::move(geometry)), rest_(std::move(rest)) {}

  std::uint64_t contentId() const { return contentId_; }
  std::size_t chunks() const;
  // A message; made anew with each call.
  SharedBytes chunk(std::size_t index) const;

 private:
  const std::uint64_t contentId_;
  const std::shared_ptr<const std::string> geometry_;
  const std::string rest_;
};

}  // namespace clothstream::stream
