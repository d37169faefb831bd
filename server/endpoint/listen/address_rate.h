// SPDX-License-Identifier: MIT
// Limits what one address does per second, and texts of addresses.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>

#include <boost/asio/ip/address.hpp>

#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {

// Addresses with the same key share their limits: those of IPv6 with the same first 64 bits, because one peer
// usually has all of them. Link-local addresses are separate, because all machines of a network share these
// bits; their key includes the network (scope). Empty for the loopback addresses, which all programs of this
// machine share.
std::string addressKey(boost::asio::ip::address address);

// Text of an address. An IPv4 address that is mapped into IPv6 (::ffff:a.b.c.d) is written as IPv4.
std::string plainText(const boost::asio::ip::address& address);

// Not thread-safe.
class AddressRate {
 public:
  AddressRate(double perSecond, double burst) : perSecond_(perSecond), burst_(burst) {}

  // Takes `cost` tokens of the address with this key. Returns false if it has fewer.
  bool take(const std::string& key, schedule::Clock::time_point now, double cost = 1);

 private:
  // Beyond this number of addresses that were active lately, counting starts again.
  static constexpr std::size_t kMaxAddresses = 4096;

  const double perSecond_, burst_;
  std::unordered_map<std::string, schedule::TokenBucket> buckets_;
};

}  // namespace clothstream::endpoint
