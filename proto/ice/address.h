// SPDX-License-Identifier: MIT
// An IP address with a UDP port.
#pragma once

#include <algorithm>
#include <array>
#include <compare>
#include <cstdint>

namespace clothstream::ice {

struct Address {
  // IPv6 address in network byte order. IPv4 addresses are mapped: ::ffff:a.b.c.d (RFC 4291,
  // section 2.5.5.2), as sockets for both families give them.
  std::array<std::uint8_t, 16> bytes{};
  std::uint16_t port = 0;

  static Address ofIpv4(const std::array<std::uint8_t, 4>& address, std::uint16_t port) {
    Address mapped{.bytes = kMapped, .port = port};
    std::ranges::copy(address, mapped.bytes.begin() + kPrefix);
    return mapped;
  }

  bool isIpv4() const { return std::equal(bytes.begin(), bytes.begin() + kPrefix, kMapped.begin()); }

  std::strong_ordering operator<=>(const Address&) const = default;

 private:
  static constexpr std::array<std::uint8_t, 16> kMapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
  static constexpr int kPrefix = 12;
};

}  // namespace clothstream::ice
