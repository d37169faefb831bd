// SPDX-License-Identifier: MIT
#include "proto/datagram/input_bundle.h"

#include <algorithm>
#include <cassert>

#include "proto/datagram/bytes.h"

namespace clothstream::datagram {

std::size_t InputSender::write(std::span<const std::byte> message, std::uint64_t nowUs,
                               std::span<std::byte> out, bool repeats) {
  assert(!message.empty() && message.size() <= kMaxInputBytes);
  messages_[next_ % messages_.size()].assign(message.begin(), message.end());
  ++next_;
  count_ = std::min(count_ + 1, kBundledMessages);
  if (repeats) copies_ = 0;
  return writeNewest(nowUs, out);
}

std::optional<std::uint64_t> InputSender::repeatUs() const {
  if (copies_ == kBundledMessages) return std::nullopt;
  return sentUs_ + kRepeatUs;
}

std::size_t InputSender::repeat(std::uint64_t nowUs, std::span<std::byte> out) {
  assert(repeatUs());
  return writeNewest(nowUs, out);
}

std::size_t InputSender::writeNewest(std::uint64_t nowUs, std::span<std::byte> out) {
  const std::uint32_t newest = next_ - 1;
  Writer writer(out.first(kMaxDatagramBytes));
  writer.number(static_cast<std::uint8_t>(Kind::input));
  writer.number(newest);
  for (std::uint32_t age = 0; age < count_; ++age) {
    const std::vector<std::byte>& message = messages_[(newest - age) % messages_.size()];
    if (sizeof(std::uint16_t) + message.size() > writer.room()) break;
    writer.number(static_cast<std::uint16_t>(message.size()));
    writer.bytes(message);
  }
  sentUs_ = nowUs;
  copies_ = std::min(copies_ + 1, kBundledMessages);
  return writer.written();
}

std::optional<InputMessages> InputReceiver::receive(std::span<const std::byte> datagram) {
  if (kindOf(datagram) != Kind::input) return std::nullopt;
  Reader reader(datagram.subspan(1));
  const auto newest = reader.number<std::uint32_t>();
  InputMessages found;  // newest first, as in the datagram
  while (reader.ok() && !reader.atEnd()) {
    if (found.count == kBundledMessages) return std::nullopt;
    const std::span<const std::byte> message = reader.take(reader.number<std::uint16_t>());
    if (message.empty()) return std::nullopt;
    found.messages[found.count++] = message;
  }
  if (!reader.ok() || found.count == 0) return std::nullopt;

  const std::int64_t unseen = std::int64_t{steps(next_, newest)} + 1;
  found.count =
      static_cast<std::size_t>(std::clamp<std::int64_t>(unseen, 0, static_cast<std::int64_t>(found.count)));
  if (found.count > 0) next_ = newest + 1;
  std::reverse(found.messages.begin(), found.messages.begin() + static_cast<std::ptrdiff_t>(found.count));
  return found;
}

}  // namespace clothstream::datagram
