// SPDX-License-Identifier: MIT
// The description of a stream, chunk by chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/schedule/clock.h"

namespace clothstream::fleet {

// Chunks come in order; the first one begins again, maybe with another content. Others are dropped.
class DescriptionDownload {
 public:
  using Clock = schedule::Clock;
  static constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
  enum class Added : std::uint8_t { dropped, incomplete, complete };

  // Request for the next chunk.
  v1::ChunkRequest request(Clock::time_point now);
  // Whether the newest request has no answer for so long that it is sent again.
  bool isOverdue(Clock::time_point now) const;
  [[nodiscard]] Added add(const v1::Chunk& chunk);
  // Begins again.
  void clear();
  const std::string& bytes() const { return bytes_; }

 private:
  std::uint64_t content_ = 0;
  std::uint32_t received_ = 0;  // chunks
  std::string bytes_;
  Clock::time_point requestedAt_{};
};

}  // namespace clothstream::fleet
