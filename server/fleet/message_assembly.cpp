// SPDX-License-Identifier: MIT
#include "server/fleet/message_assembly.h"

#include <memory>
#include <vector>

namespace clothstream::fleet {

std::optional<ReceivedMessage> MessageAssembly::add(const v1::Segment& segment) {
  if (segment.sequence() != newest_ + 1) return std::nullopt;
  ++newest_;
  if (segment.end() != v1::TUNNEL_END_UNSPECIFIED) {
    whole_ = newest_;
    return ReceivedMessage{.message = nullptr, .end = segment.end(), .sequence = newest_};
  }
  if (partial_.size() + segment.data().size() <= kMaxMessageBytes) partial_ += segment.data();
  if (segment.more()) {
    use(used_);
    return std::nullopt;
  }
  whole_ = newest_;
  const auto* const bytes = reinterpret_cast<const std::byte*>(partial_.data());
  ReceivedMessage complete{
      .message = std::make_shared<std::vector<std::byte>>(bytes, bytes + partial_.size()),
      .sequence = newest_,
      .timeUs = segment.time_us()};
  partial_.clear();
  return complete;
}

}  // namespace clothstream::fleet
