// SPDX-License-Identifier: MIT
// Writes DatagramOffer and reads DatagramAnswer (proto/clothstream/v1/session.proto).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/wire.h"

namespace clothstream::client {

inline constexpr std::size_t kMaxDatagramAddresses = 16;

// How to reach the server. Ranges are those of cs_datagram_answer.
struct DatagramAnswer {
  std::string ufrag, password;
  std::array<std::uint8_t, 32> fingerprint{};
  std::vector<std::string>
      addresses;  // empty: the server opens no datagrams, and the other members are empty
  std::uint32_t port = 0;
};

// Whether version and members are those that cs_datagram_offer allows.
[[nodiscard]] bool isAllowed(const cs_datagram_offer& offer);
// Replaces the content of `out`. The offer must be allowed.
void writeDatagramOffer(std::string& out, std::uint64_t requestId, const cs_datagram_offer& offer);

// nullopt if the message is not well formed, or a member is out of range although there are addresses.
[[nodiscard]] std::optional<DatagramAnswer> readDatagramAnswer(Bytes message);

}  // namespace clothstream::client
