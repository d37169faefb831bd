// SPDX-License-Identifier: MIT
// Content that a peer uploads in chunks before it creates a scene from it.
#pragma once

#include <cstdint>
#include <string>

#include "server/delivery/wire_types.h"
#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"

namespace clothstream::session {

// One content of one peer at a time. Not thread-safe.
class Upload {
 public:
  explicit Upload(hosting::UploadBudget& budget) : reservation_(budget) {}

  // Adds the next chunk, or the first chunk of another content. An error drops everything uploaded so far.
  [[nodiscard]] messages::Result<void> add(const v1::Chunk& chunk);
  // Moves a complete content out, or returns an error if it is not complete.
  [[nodiscard]] messages::Result<hosting::UploadedContent> take(std::uint64_t contentId);

 private:
  messages::Result<void> check(const v1::Chunk& chunk) const;
  void drop();

  std::string bytes_;
  hosting::UploadReservation reservation_;
  std::uint64_t contentId_ = 0, totalBytes_ = 0;
  std::uint32_t next_ = 0, count_ = 0;  // chunks
};

}  // namespace clothstream::session
