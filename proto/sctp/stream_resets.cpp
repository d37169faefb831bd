// SPDX-License-Identifier: MIT
#include "proto/sctp/stream_resets.h"

#include <algorithm>

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {
namespace {

// RFC 6525, section 4.
constexpr std::uint16_t kOutgoingReset = 13, kIncomingReset = 14, kTsnReset = 15, kResponse = 16,
                        kAddOutgoing = 17, kAddIncoming = 18;
// Results (RFC 6525, section 4.4).
constexpr std::uint32_t kPerformed = 1, kDenied = 2, kBadNumber = 5, kInProgress = 6;
constexpr std::size_t kResponseBytes = 12;

bool isRequest(const Parameter& parameter) {
  constexpr std::array kRequests{kOutgoingReset, kIncomingReset, kTsnReset, kAddOutgoing, kAddIncoming};
  return std::ranges::find(kRequests, parameter.type) != kRequests.end() && parameter.value.size() >= 4;
}

void appendResponse(std::vector<std::byte>& out, std::uint32_t number, std::uint32_t result) {
  const std::size_t at = out.size();
  out.resize(at + kResponseBytes);
  const std::span<std::byte> response = std::span(out).subspan(at);
  write16(response, 0, kResponse);
  write16(response, 2, kResponseBytes);
  write32(response, 4, number);
  write32(response, 8, result);
}

}  // namespace

bool StreamResets::receive(std::span<const std::byte> value, std::vector<std::byte>& responses,
                           const Reset& reset) {
  constexpr int kMaxParameters = 2;
  responses.clear();
  bool done = false;
  for (int i = 0; i < kMaxParameters; ++i) {
    const auto parameter = takeParameter(value);
    if (!parameter) break;
    if (parameter->type == kResponse) {
      done |= readResponse(parameter->value);
    } else if (isRequest(*parameter)) {
      appendResponse(responses, read32(parameter->value, 0), answer(*parameter, reset));
    }
  }
  return done;
}

// The numbers of requests make repeated ones known, which get the same answer (RFC 6525, section 5.2.1).
std::uint32_t StreamResets::answer(const Parameter& request, const Reset& reset) {
  constexpr std::size_t kHeader = 12;
  const std::uint32_t number = read32(request.value, 0);
  if (number == peerNumber_ - 1) return newestResult_;
  if (number != peerNumber_) return kBadNumber;
  ++peerNumber_;
  if (request.type != kOutgoingReset || request.value.size() < kHeader) return newestResult_ = kDenied;
  // Messages are delivered as they arrive and carry no number of their stream that counts. So there is no
  // need to wait for those before the reset.
  const std::span<const std::byte> list = request.value.subspan(kHeader);
  if (list.size() < 2) reset(std::nullopt);
  for (std::size_t at = 0; at + 2 <= list.size(); at += 2) reset(read16(list, at));
  return newestResult_ = kPerformed;
}

bool StreamResets::readResponse(std::span<const std::byte> value) {
  if (value.size() < 8 || requests_.empty() || read32(value, 0) != ownNumber_) return false;
  if (read32(value, 4) == kInProgress) return false;
  ++ownNumber_;
  requests_.erase(requests_.begin());
  return true;
}

bool StreamResets::request(std::uint16_t stream, std::uint32_t newestTsn) {
  if (requests_.size() == kMaxRequests ||
      std::ranges::find(requests_, stream, &Request::stream) != requests_.end())
    return false;
  requests_.push_back({stream, newestTsn});
  return true;
}

void StreamResets::writeRequest(std::span<std::byte> value) const {
  write16(value, 0, kOutgoingReset);
  write16(value, 2, kRequestBytes);
  write32(value, 4, ownNumber_);
  write32(value, 8, peerNumber_ - 1);
  write32(value, 12, requests_.front().newestTsn);
  write16(value, 16, requests_.front().stream);
}

}  // namespace clothstream::sctp
