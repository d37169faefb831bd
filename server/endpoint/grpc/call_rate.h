// SPDX-License-Identifier: MIT
// Limits the calls with one response that a peer makes.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>

#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {

// Counts per address, as Admission does; programs of this machine share one count. Not thread-safe.
class CallRate {
 public:
  // Per second, with twice as many at once.
  static constexpr double kCallsPerSecond = 100;

  // `peer` is the address as gRPC writes it, such as ipv4:192.0.2.1:50000. Returns false if the call is too
  // many.
  bool take(const std::string& peer, schedule::Clock::time_point now);

 private:
  // Beyond this number of addresses, counting starts again.
  static constexpr std::size_t kMaxAddresses = 4096;

  std::unordered_map<std::string, schedule::TokenBucket> buckets_;
};

}  // namespace clothstream::endpoint
