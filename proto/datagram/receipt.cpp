// SPDX-License-Identifier: MIT
#include "proto/datagram/receipt.h"

#include "proto/datagram/bytes.h"

namespace clothstream::datagram {
namespace {

constexpr unsigned kMaskBits = 64;

}  // namespace

bool Receipt::shows(std::uint32_t packet) const {
  const std::uint32_t age = newest - packet;
  if (age == 0) return true;
  return age <= kMaskBits && (before >> (age - 1) & 1) != 0;
}

std::size_t writeReceipt(const Receipt& receipt, std::span<std::byte> out) {
  Writer writer(out);
  writer.number(static_cast<std::uint8_t>(Kind::receipt));
  writer.number(receipt.newest);
  writer.number(receipt.arrivalUs);
  writer.number(receipt.before);
  return writer.written();
}

std::optional<Receipt> parseReceipt(std::span<const std::byte> datagram) {
  if (kindOf(datagram) != Kind::receipt) return std::nullopt;
  Reader reader(datagram.subspan(1));
  Receipt receipt;
  receipt.newest = reader.number<std::uint32_t>();
  receipt.arrivalUs = reader.number<std::uint32_t>();
  receipt.before = reader.number<std::uint64_t>();
  if (!reader.ok() || !reader.atEnd()) return std::nullopt;
  return receipt;
}

void ReceivedPackets::add(std::uint32_t packet, std::uint64_t nowUs) {
  const std::int32_t ahead = any_ ? steps(receipt_.newest, packet) : 1;
  if (ahead == 0) return;
  if (ahead > 0) {
    const auto moved = static_cast<unsigned>(ahead);
    std::uint64_t before = moved < kMaskBits ? receipt_.before << moved : 0;
    if (any_ && moved <= kMaskBits) before |= std::uint64_t{1} << (moved - 1);
    receipt_ = {.newest = packet, .arrivalUs = static_cast<std::uint32_t>(nowUs), .before = before};
    any_ = true;
  } else {
    const std::uint32_t age = receipt_.newest - packet;
    if (age > kMaskBits || receipt_.shows(packet)) return;
    receipt_.before |= std::uint64_t{1} << (age - 1);
  }
  if (unreported_++ == 0) firstUnreportedUs_ = nowUs;
}

std::optional<std::uint64_t> ReceivedPackets::dueUs() const {
  if (unreported_ == 0) return std::nullopt;
  return firstUnreportedUs_ + (unreported_ < kMaxUnreported ? kIntervalUs : 0);
}

std::optional<Receipt> ReceivedPackets::take() {
  if (unreported_ == 0) return std::nullopt;
  unreported_ = 0;
  return receipt_;
}

}  // namespace clothstream::datagram
