// SPDX-License-Identifier: MIT
// Stream description, which a decoder needs before its first frame, in chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/delivery/envelope.h"

namespace clothstream::delivery {

// Immutable. Shared by all peers that join while it is valid. Most of its bytes are geometry, which all
// descriptions of a scene share. A mailbox that still sends an outdated description therefore costs little.
class DescriptionChunks {
 public:
  // `geometry` and `rest` are serialised StreamDescriptions with different fields: the cloths, and the
  // others.
  DescriptionChunks(std::uint64_t contentId, std::shared_ptr<const std::string> geometry, std::string rest)
      : contentId_(contentId), geometry_(std::move(geometry)), rest_(std::move(rest)) {}

  std::uint64_t contentId() const { return contentId_; }
  // Number of chunks.
  std::size_t count() const;
  // Serialises one chunk as a message; nothing is cached. `index` is below count().
  SharedBytes chunk(std::size_t index) const;

 private:
  const std::uint64_t contentId_;
  const std::shared_ptr<const std::string> geometry_;
  const std::string rest_;
};

}  // namespace clothstream::delivery
