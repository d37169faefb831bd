// SPDX-License-Identifier: MIT
#include "proto/ice/stun_message.h"

#include <algorithm>
#include <cassert>

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "proto/checksum/crc32.h"

namespace clothstream::ice {
namespace {

constexpr std::size_t kHeaderBytes = 20;
constexpr std::size_t kAttributeHeader = 4;
constexpr std::uint32_t kMagicCookie = 0x2112A442;
constexpr std::uint32_t kFingerprintMask = 0x5354554E;
constexpr std::size_t kHashBytes = 20;  // of HMAC-SHA1

// Types of attributes (RFC 8489, section 18.3; RFC 8445, section 16.1). A receiver must understand those
// below kOptional.
enum Attribute : std::uint16_t {
  kMappedAddress = 0x0001,
  kUsername = 0x0006,
  kMessageIntegrity = 0x0008,
  kErrorCode = 0x0009,
  kUnknownAttributes = 0x000A,
  kRealm = 0x0014,
  kNonce = 0x0015,
  kMessageIntegritySha256 = 0x001C,
  kXorMappedAddress = 0x0020,
  kPriority = 0x0024,
  kUseCandidate = 0x0025,
  kOptional = 0x8000,
  kFingerprint = 0x8028,
  kIceControlled = 0x8029,
  kIceControlling = 0x802A,
};

using Hash = std::array<unsigned char, kHashBytes>;

template <typename Number>
Number numberAt(std::span<const std::byte> bytes, std::size_t at) {
  Number number = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    number = static_cast<Number>(number << 8 | std::to_integer<Number>(bytes[at + i]));
  return number;
}

void setNumber(std::span<std::byte> bytes, std::size_t at, std::uint64_t number, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i)
    bytes[at + i] = static_cast<std::byte>(number >> (8 * (size - 1 - i)));
}

constexpr std::size_t padded(std::size_t size) {
  return (size + 3) / 4 * 4;
}

std::uint32_t fingerprintOf(std::span<const std::byte> before) {
  return checksum::crc32({reinterpret_cast<const char*>(before.data()), before.size()}) ^ kFingerprintMask;
}

// Hash of the bytes before MESSAGE-INTEGRITY. The header's length counts this attribute, too.
Hash integrityOf(std::span<const std::byte> before, std::string_view password) {
  assert(before.size() <= kMaxStunBytes);
  std::array<std::byte, kMaxStunBytes> bytes{};
  std::ranges::copy(before, bytes.begin());
  setNumber(bytes, 2, before.size() + kAttributeHeader + kHashBytes - kHeaderBytes, 2);
  Hash hash{};
  unsigned size = 0;
  [[maybe_unused]] const unsigned char* const made =
      HMAC(EVP_sha1(), password.data(), static_cast<int>(password.size()),
           reinterpret_cast<const unsigned char*>(bytes.data()), before.size(), hash.data(), &size);
  assert(made != nullptr && size == hash.size());
  return hash;
}

// XOR-MAPPED-ADDRESS is XORed with the cookie and the transaction (RFC 8489, section 14.2).
std::array<std::byte, 16> maskOf(const TransactionId& transaction) {
  std::array<std::byte, 16> mask{};
  setNumber(mask, 0, kMagicCookie, 4);
  std::ranges::copy(transaction, mask.begin() + 4);
  return mask;
}

std::optional<Address> readAddress(std::span<const std::byte> value, const TransactionId& transaction) {
  constexpr std::size_t kIpv4Bytes = 8, kIpv6Bytes = 20;
  if (value.size() != kIpv4Bytes && value.size() != kIpv6Bytes) return std::nullopt;
  const bool ipv4 = value.size() == kIpv4Bytes;
  if (std::to_integer<int>(value[1]) != (ipv4 ? 1 : 2)) return std::nullopt;
  const auto port = static_cast<std::uint16_t>(numberAt<std::uint16_t>(value, 2) ^ kMagicCookie >> 16);
  Address address = ipv4 ? Address::ofIpv4({}, port) : Address{.port = port};
  const auto mask = maskOf(transaction);
  const std::size_t size = value.size() - 4, first = address.bytes.size() - size;
  for (std::size_t i = 0; i < size; ++i)
    address.bytes[first + i] = std::to_integer<std::uint8_t>(value[4 + i] ^ mask[i]);
  return address;
}

// Reads one attribute before MESSAGE-INTEGRITY. Returns false if its length or its value is wrong.
bool readAttribute(std::uint16_t type, std::span<const std::byte> value, StunMessage& message) {
  switch (type) {
    case kUsername:
      if (value.empty()) return false;
      if (message.username.empty())
        message.username = {reinterpret_cast<const char*>(value.data()), value.size()};
      return true;
    case kPriority:
      if (value.size() != 4) return false;
      if (!message.priority) message.priority = numberAt<std::uint32_t>(value, 0);
      return true;
    case kIceControlled:
    case kIceControlling:
      if (value.size() != 8) return false;
      if (message.role) return true;
      message.role = type == kIceControlled ? Role::controlled : Role::controlling;
      message.tieBreaker = numberAt<std::uint64_t>(value, 0);
      return true;
    case kUseCandidate:
      message.useCandidate = true;
      return value.empty();
    case kXorMappedAddress: {
      const auto address = readAddress(value, message.transaction);
      if (!message.mapped) message.mapped = address;
      return address.has_value();
    }
    case kErrorCode: {
      if (value.size() < 4) return false;
      const unsigned hundreds = std::to_integer<unsigned>(value[2]) & 7;
      const unsigned rest = std::to_integer<unsigned>(value[3]);
      if (hundreds < 3 || hundreds > 6 || rest > 99) return false;
      if (message.error == 0) message.error = static_cast<std::uint16_t>(100 * hundreds + rest);
      return true;
    }
    case kMappedAddress:
    case kUnknownAttributes:
    case kRealm:
    case kNonce:
    case kMessageIntegritySha256:
      return true;  // known, but without meaning for ICE
    default:
      if (type < kOptional && message.unknown.size() < StunMessage::kMaxUnknown)
        message.unknown.push_back(type);
      return true;
  }
}

class Writer {
 public:
  Writer(StunKind kind, const TransactionId& transaction) {
    add(static_cast<std::uint64_t>(kind), 2);
    add(0, 2);
    add(kMagicCookie, 4);
    bytes_.insert(bytes_.end(), transaction.begin(), transaction.end());
  }

  void attribute(std::uint16_t type, std::span<const std::byte> value) {
    add(type, 2);
    add(value.size(), 2);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.resize(padded(bytes_.size()));
  }
  void attribute(std::uint16_t type, std::uint64_t number, std::size_t size) {
    add(type, 2);
    add(size, 2);
    add(number, size);
    bytes_.resize(padded(bytes_.size()));
  }
  void address(const Address& address, const TransactionId& transaction) {
    std::array<std::byte, 20> value{};
    const std::size_t size = address.isIpv4() ? 4 : 16, first = address.bytes.size() - size;
    setNumber(value, 0, address.isIpv4() ? 1 : 2, 2);
    setNumber(value, 2, address.port ^ kMagicCookie >> 16, 2);
    const auto mask = maskOf(transaction);
    for (std::size_t i = 0; i < size; ++i) value[4 + i] = std::byte{address.bytes[first + i]} ^ mask[i];
    attribute(kXorMappedAddress, std::span(value).first(4 + size));
  }

  // Adds MESSAGE-INTEGRITY and FINGERPRINT.
  std::vector<std::byte> finish(std::string_view password) && {
    const Hash hash = integrityOf(bytes_, password);
    attribute(kMessageIntegrity, std::as_bytes(std::span(hash)));
    constexpr std::size_t kSize = 4;
    setNumber(bytes_, 2, bytes_.size() + kAttributeHeader + kSize - kHeaderBytes, 2);
    attribute(kFingerprint, fingerprintOf(bytes_), kSize);
    return std::move(bytes_);
  }

 private:
  void add(std::uint64_t number, std::size_t size) {
    bytes_.resize(bytes_.size() + size);
    setNumber(bytes_, bytes_.size() - size, number, size);
  }

  std::vector<std::byte> bytes_;
};

}  // namespace

std::optional<StunMessage> readStun(std::span<const std::byte> datagram) {
  if (datagram.size() < kHeaderBytes || datagram.size() > kMaxStunBytes) return std::nullopt;
  const std::size_t length = numberAt<std::uint16_t>(datagram, 2);
  if (length != datagram.size() - kHeaderBytes || length % 4 != 0) return std::nullopt;
  if (numberAt<std::uint32_t>(datagram, 4) != kMagicCookie) return std::nullopt;
  StunMessage message;
  message.kind = static_cast<StunKind>(numberAt<std::uint16_t>(datagram, 0));
  if (message.kind != StunKind::request && message.kind != StunKind::indication &&
      message.kind != StunKind::success && message.kind != StunKind::error)
    return std::nullopt;
  std::ranges::copy(datagram.subspan(8, message.transaction.size()), message.transaction.begin());

  std::size_t at = kHeaderBytes;
  while (at < datagram.size()) {  // four bytes are left, because the length is a multiple of four
    const auto type = numberAt<std::uint16_t>(datagram, at);
    const std::size_t size = numberAt<std::uint16_t>(datagram, at + 2);
    const std::size_t end = at + kAttributeHeader + padded(size);
    if (end > datagram.size()) return std::nullopt;
    const auto value = datagram.subspan(at + kAttributeHeader, size);
    if (type == kFingerprint) {
      const bool right = size == 4 && end == datagram.size() &&
                         numberAt<std::uint32_t>(value, 0) == fingerprintOf(datagram.first(at));
      if (!right) return std::nullopt;
      return message;
    }
    if (message.integrityAt == 0) {
      if (type == kMessageIntegrity) {
        if (size != kHashBytes) return std::nullopt;
        message.integrityAt = at;
      } else if (!readAttribute(type, value, message)) {
        return std::nullopt;
      }
    }
    at = end;
  }
  return std::nullopt;  // no FINGERPRINT
}

bool hasIntegrity(const StunMessage& message, std::span<const std::byte> datagram,
                  std::string_view password) {
  if (message.integrityAt == 0) return false;
  const Hash right = integrityOf(datagram.first(message.integrityAt), password);
  const auto claimed = datagram.subspan(message.integrityAt + kAttributeHeader, right.size());
  return CRYPTO_memcmp(right.data(), claimed.data(), right.size()) == 0;
}

std::vector<std::byte> writeStun(const StunMessage& message, std::string_view password) {
  assert(message.username.size() <= kMaxUsername && message.unknown.size() <= StunMessage::kMaxUnknown);
  Writer writer(message.kind, message.transaction);
  if (!message.username.empty())
    writer.attribute(kUsername, std::as_bytes(std::span(message.username.data(), message.username.size())));
  if (message.priority) writer.attribute(kPriority, *message.priority, 4);
  if (message.role)
    writer.attribute(*message.role == Role::controlled ? kIceControlled : kIceControlling, message.tieBreaker,
                     8);
  if (message.useCandidate) writer.attribute(kUseCandidate, {});
  if (message.mapped) writer.address(*message.mapped, message.transaction);
  if (message.error != 0)
    writer.attribute(kErrorCode, std::uint64_t{message.error / 100U} << 8 | message.error % 100U, 4);
  if (!message.unknown.empty()) {
    std::vector<std::byte> types(2 * message.unknown.size());
    for (std::size_t i = 0; i < message.unknown.size(); ++i) setNumber(types, 2 * i, message.unknown[i], 2);
    writer.attribute(kUnknownAttributes, types);
  }
  return std::move(writer).finish(password);
}

}  // namespace clothstream::ice
