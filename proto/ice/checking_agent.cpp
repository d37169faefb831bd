// SPDX-License-Identifier: MIT
#include "proto/ice/checking_agent.h"

#include <algorithm>
#include <utility>

namespace clothstream::ice {
namespace {

// Each address once, IPv6 and IPv4 alternately, in the given order within a family.
std::vector<Address> inOrderOfChecks(std::span<const Address> candidates) {
  std::vector<Address> ordered;
  auto ipv6 = candidates.begin(), ipv4 = candidates.begin();
  const auto takeNext = [&](auto& next, bool isIpv4) {
    next = std::find_if(next, candidates.end(), [&](const Address& address) {
      return address.isIpv4() == isIpv4 && std::ranges::find(ordered, address) == ordered.end();
    });
    if (next != candidates.end() && ordered.size() < CheckingAgent::kMaxCandidates)
      ordered.push_back(*next++);
  };
  while ((ipv6 != candidates.end() || ipv4 != candidates.end()) &&
         ordered.size() < CheckingAgent::kMaxCandidates) {
    takeNext(ipv6, false);
    takeNext(ipv4, true);
  }
  return ordered;
}

// The interval times 0.8 to 1.2, by a random byte, so that the checks of many peers spread (RFC 7675).
Time::duration spread(std::chrono::milliseconds interval, std::byte random) {
  return interval * (8 * 255 + 4 * std::to_integer<int>(random)) / (10 * 255);
}

}  // namespace

CheckingAgent::CheckingAgent(Credentials local, Credentials remote, std::span<const Address> candidates,
                             Time now)
    : pairing_(std::move(local), std::move(remote), Role::controlling),
      candidates_(inOrderOfChecks(candidates)),
      lastAnswer_(now),
      nextCheck_(candidates_.empty() ? Time::max() : now) {}

std::vector<Datagram> CheckingAgent::advance(Time now) {
  if (now < nextTime()) return {};
  if (now >= silentAt_) {
    silentAt_ = Time::max();
    repeatAfter_ = kSilence;
  }
  if (isOver(now)) {
    nextCheck_ = Time::max();
    return {};
  }
  if (!selected(now)) selected_.reset();
  const Address to = selected_ ? *selected_ : candidates_[nextCandidate_++ % candidates_.size()];
  if (sent_.size() == kMaxSent) sent_.erase(sent_.begin());
  sent_.push_back({.transaction = newTransaction(), .to = to, .at = now});
  nextCheck_ = now + (selected_ ? repeatAfter_ : kPace);
  std::vector<Datagram> out;
  out.push_back({.to = to, .bytes = pairing_.check(sent_.back().transaction, selected_.has_value())});
  return out;
}

std::vector<Datagram> CheckingAgent::handle(const Address& from, std::span<const std::byte> datagram,
                                            Time now) {
  std::vector<Datagram> out;
  if (isOver(now)) return out;
  const auto message = readStun(datagram);
  if (!message) return out;
  if (auto answer = pairing_.answer(*message, datagram, from)) {
    out.push_back({.to = from, .bytes = std::move(answer->bytes)});
    return out;
  }
  const auto sent = std::ranges::find_if(sent_, [&](const SentCheck& check) {
    return check.to == from && check.transaction == message->transaction;  // symmetric, RFC 8445, 7.2.5.2.1
  });
  if (sent == sent_.end() || !pairing_.isAuthenticResponse(*message, datagram)) return out;
  roundTrip_ = now - sent->at;
  lastAnswer_ = now;
  repeatAfter_ = kRepeatAfter;
  // Answers to other checks say nothing new, and an earlier one does not confirm the nomination.
  sent_.clear();
  if (selected_) {
    nextCheck_ = now + spread(kConsentInterval, message->transaction.back());
    return out;
  }
  selected_ = from;
  nextCheck_ = now;
  return advance(now);
}

}  // namespace clothstream::ice
