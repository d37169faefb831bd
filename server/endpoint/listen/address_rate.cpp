// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/address_rate.h"

#include <iterator>

namespace clothstream::endpoint {
namespace {

namespace ip = boost::asio::ip;

constexpr std::size_t kPrefixBytes = 8;

ip::address withoutMapping(const ip::address& address) {
  if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address;
  return ip::make_address_v4(ip::v4_mapped, address.to_v6());
}

}  // namespace

std::string plainText(const ip::address& address) {
  return withoutMapping(address).to_string();
}

std::string addressKey(ip::address address) {
  address = withoutMapping(address);
  if (address.is_loopback()) return {};
  if (address.is_v4()) {
    const auto bytes = address.to_v4().to_bytes();
    return {bytes.begin(), bytes.end()};
  }
  const ip::address_v6 v6 = address.to_v6();
  const auto bytes = v6.to_bytes();
  if (v6.is_link_local()) return std::string(bytes.begin(), bytes.end()) + std::to_string(v6.scope_id());
  return {bytes.begin(), bytes.begin() + kPrefixBytes};
}

bool AddressRate::take(const std::string& key, schedule::Clock::time_point now, double cost) {
  if (buckets_.size() > kMaxAddresses)
    for (auto each = buckets_.begin(); each != buckets_.end();)
      each =
          each->second.isFull(now) ? buckets_.erase(each) : std::next(each);  // a full one is like a new one
  if (buckets_.size() > kMaxAddresses) buckets_.clear();
  return buckets_.try_emplace(key, perSecond_, burst_).first->second.take(now, cost);
}

}  // namespace clothstream::endpoint
