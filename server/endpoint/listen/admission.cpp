// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/admission.h"

#include <algorithm>
#include <mutex>
#include <unordered_map>

#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {
namespace {

namespace ip = boost::asio::ip;

constexpr std::size_t kPrefixBytes = 8;

}  // namespace

std::string addressKey(ip::address address) {
  if (address.is_v6() && address.to_v6().is_v4_mapped())
    address = ip::make_address_v4(ip::v4_mapped, address.to_v6());
  if (address.is_loopback()) return {};
  if (address.is_v4()) {
    const auto bytes = address.to_v4().to_bytes();
    return {bytes.begin(), bytes.end()};
  }
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.begin() + kPrefixBytes};
}

// The table has an entry for each address with open connections only, so the limit of connections bounds it.
struct Admission::Ticket::Counts {
  explicit Counts(const ConnectionLimits& of)
      : limits(of), rate(of.connectionsPerSecond, std::max(1.0, of.connectionsPerSecond)) {}

  const ConnectionLimits limits;
  std::mutex mutex;
  schedule::TokenBucket rate;
  std::size_t connections = 0;
  std::unordered_map<std::string, std::size_t> ofAddress;
};

Admission::Ticket::~Ticket() {
  if (!counts_) return;
  const std::lock_guard lock(counts_->mutex);
  --counts_->connections;
  if (address_.empty()) return;
  const auto entry = counts_->ofAddress.find(address_);
  if (--entry->second == 0) counts_->ofAddress.erase(entry);
}

Admission::Admission(const ConnectionLimits& limits) : counts_(std::make_shared<Ticket::Counts>(limits)) {}

Admission::~Admission() = default;

tl::expected<Admission::Ticket, Admission::Refusal> Admission::admit(const ip::address& address,
                                                                     schedule::Clock::time_point now) {
  Ticket::Counts& counts = *counts_;
  std::string key = addressKey(address);
  const std::lock_guard lock(counts.mutex);
  if (counts.connections >= counts.limits.connections) return tl::unexpected(Refusal::connections);
  if (!key.empty()) {
    const auto entry = counts.ofAddress.find(key);
    if (entry != counts.ofAddress.end() && entry->second >= counts.limits.connectionsPerAddress)
      return tl::unexpected(Refusal::connectionsOfAddress);
  }
  if (!counts.rate.take(now)) return tl::unexpected(Refusal::rate);
  ++counts.connections;
  if (!key.empty()) ++counts.ofAddress[key];
  return Ticket(counts_, std::move(key));
}

std::size_t Admission::connections() const {
  const std::lock_guard lock(counts_->mutex);
  return counts_->connections;
}

}  // namespace clothstream::endpoint
