// SPDX-License-Identifier: MIT
#include "proto/dtls/record_guard.h"

#include <cstdint>
#include <optional>

#include "proto/dtls/limits.h"

namespace clothstream::dtls {
namespace {

constexpr std::size_t kRecordHeader = 13, kMessageHeader = 12;
constexpr unsigned kMajorVersion = 0xFE;  // of DTLS 1.0 and 1.2
// A client sends at most six messages, with a server's cookie seven.
constexpr unsigned kMaxMessages = 8;
// Finished has 24 bytes, and ciphers add at least 16.
constexpr std::size_t kLeastFinished = 40;
enum ContentType : unsigned { kChangeCipherSpec = 20, kAlert = 21, kHandshake = 22 };

struct Record {
  unsigned type, epoch;
  std::span<const std::byte> content;
};

std::uint32_t numberAt(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < size; ++i) number = number << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return number;
}

// Takes the first record off the datagram. Nothing if it is not whole.
std::optional<Record> takeRecord(std::span<const std::byte>& datagram) {
  if (datagram.size() < kRecordHeader || numberAt(datagram, 1, 1) != kMajorVersion) return std::nullopt;
  const std::size_t end = kRecordHeader + numberAt(datagram, 11, 2);
  if (end > datagram.size()) return std::nullopt;
  const Record record{.type = numberAt(datagram, 0, 1),
                      .epoch = numberAt(datagram, 3, 2),
                      .content = datagram.first(end).subspan(kRecordHeader)};
  datagram = datagram.subspan(end);
  return record;
}

// Returns whether a plain record of the handshake has whole fragments of messages within the bounds.
bool hasBoundedMessages(std::span<const std::byte> fragments) {
  while (!fragments.empty()) {
    if (fragments.size() < kMessageHeader) return false;
    const std::uint32_t size = numberAt(fragments, 1, 3), number = numberAt(fragments, 4, 2);
    const std::size_t end = kMessageHeader + numberAt(fragments, 9, 3);
    if (size > kMaxHandshakeMessage || number >= kMaxMessages || end > fragments.size()) return false;
    fragments = fragments.subspan(end);
  }
  return true;
}

}  // namespace

bool hasWholeRecords(std::span<const std::byte> datagram, std::size_t leastEncrypted) {
  while (!datagram.empty()) {
    const auto record = takeRecord(datagram);
    if (!record || (record->epoch > 0 && record->content.size() < leastEncrypted)) return false;
  }
  return true;
}

bool HandshakeGuard::admits(std::span<const std::byte> datagram) {
  bytes_ += datagram.size();
  if (isExhausted()) return false;
  int encrypted = 0;
  while (!datagram.empty()) {
    const auto record = takeRecord(datagram);
    if (!record) return false;
    if (record->epoch == 0) {
      const bool bounded = record->type == kChangeCipherSpec || record->type == kAlert ||
                           (record->type == kHandshake && hasBoundedMessages(record->content));
      if (!bounded) return false;
    } else if (record->epoch > 1 || record->type != kHandshake || record->content.size() < kLeastFinished ||
               encrypted_ + ++encrypted > kMaxEncrypted) {
      return false;
    }
  }
  encrypted_ += encrypted;
  return true;
}

}  // namespace clothstream::dtls
