// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/admission.h"

#include <algorithm>
#include <mutex>
#include <unordered_map>

#include "server/endpoint/listen/address_rate.h"
#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {
namespace {

namespace ip = boost::asio::ip;
using telemetry::Refusal;

}  // namespace

// The table has an entry for each address with open connections only, so the limit of connections bounds it.
struct Admission::Ticket::Counts {
  explicit Counts(const ConnectionLimits& of)
      : limits(of),
        rate(of.connectionsPerSecond, std::max(1.0, of.connectionsPerSecond)),
        rateOfAddress(of.connectionsPerSecondOfAddress, std::max(1.0, of.connectionsPerSecondOfAddress)) {}

  const ConnectionLimits limits;
  std::mutex mutex;
  schedule::TokenBucket rate;
  AddressRate rateOfAddress;
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

tl::expected<Admission::Ticket, telemetry::Refusal> Admission::admit(const ip::address& address,
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
  // The limit of the address is checked first, so that one address does not use up the common rate.
  if (!key.empty() && !counts.rateOfAddress.take(key, now))
    return tl::unexpected(Refusal::connectionRateOfAddress);
  if (!counts.rate.take(now)) return tl::unexpected(Refusal::connectionRate);
  if (!key.empty()) ++counts.ofAddress[key];
  ++counts.connections;
  return Ticket(counts_, std::move(key));
}

std::size_t Admission::connections() const {
  const std::lock_guard lock(counts_->mutex);
  return counts_->connections;
}

}  // namespace clothstream::endpoint
