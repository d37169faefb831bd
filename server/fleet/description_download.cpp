// SPDX-License-Identifier: MIT
#include "server/fleet/description_download.h"

#include <chrono>

namespace clothstream::fleet {
namespace {

constexpr std::chrono::seconds kAskAgain{2};

}  // namespace

v1::ChunkRequest DescriptionDownload::request(Clock::time_point now) {
  v1::ChunkRequest request;
  request.set_content_id(received_ > 0 ? content_ : 0);
  request.set_index(received_);
  requestedAt_ = now;
  return request;
}

bool DescriptionDownload::isOverdue(Clock::time_point now) const {
  return now - requestedAt_ > kAskAgain;
}

DescriptionDownload::Added DescriptionDownload::add(const v1::Chunk& chunk) {
  if (chunk.index() == 0) {
    clear();
    content_ = chunk.content_id();
  }
  if (chunk.content_id() != content_ || chunk.index() != received_ || chunk.total_bytes() > kMaxBytes ||
      bytes_.size() + chunk.data().size() > chunk.total_bytes())
    return Added::dropped;
  bytes_ += chunk.data();
  ++received_;
  return received_ == chunk.count() ? Added::complete : Added::incomplete;
}

void DescriptionDownload::clear() {
  bytes_ = {};
  received_ = 0;
}

}  // namespace clothstream::fleet
