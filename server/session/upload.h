// SPDX-License-Identifier: MIT
// Content that a peer uploads in chunks before it creates a scene from it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "server/delivery/wire_types.h"
#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"
#include "server/schedule/clock.h"

namespace clothstream::session {

struct UploadPace {
  std::chrono::milliseconds maxTime{};
  double minBytesPerSecond = 0;  // after hosting::kUploadPatience
};

// One content of one peer at a time. Not thread-safe.
class Upload {
 public:
  // `address` is the key of the peer's address, for its share of the budget; empty for none.
  Upload(hosting::UploadBudget& budget, std::string address) : reservation_(budget, std::move(address)) {}

  // Returns whether the peer has ever begun one.
  bool hasBegun() const { return begun_ != schedule::Clock::time_point{}; }

  // Adds the next chunk, or the first chunk of another content. An error drops everything uploaded so far.
  [[nodiscard]] messages::Result<void> add(const v1::Chunk& chunk, schedule::Clock::time_point now);
  // Returns an error, and drops everything, if the upload is too slow, or is there for too long. Call it
  // about once a second.
  [[nodiscard]] messages::Result<void> checkPace(const UploadPace& pace, schedule::Clock::time_point now);
  // Moves a complete content out, or returns an error if it is not complete.
  [[nodiscard]] messages::Result<hosting::UploadedContent> take(std::uint64_t contentId);

 private:
  messages::Result<void> check(const v1::Chunk& chunk) const;
  void drop();

  std::string bytes_;
  hosting::UploadReservation reservation_;
  schedule::Clock::time_point begun_{};
  std::uint64_t contentId_ = 0, totalBytes_ = 0;
  std::uint32_t next_ = 0, count_ = 0;  // chunks
};

}  // namespace clothstream::session
