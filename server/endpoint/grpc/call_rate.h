// SPDX-License-Identifier: MIT
// Limits the calls with one response that a peer makes.
#pragma once

#include <string>

#include "server/endpoint/listen/address_rate.h"

namespace clothstream::endpoint {

// Programs of this machine share one limit. Not thread-safe.
class CallRate {
 public:
  // Calls per second. The burst is twice this number.
  static constexpr double kCallsPerSecond = 100;
  // A call that reads or makes a whole scene counts as this many.
  static constexpr double kSceneCost = 4;

  // `peer` is the address as gRPC writes it, such as ipv4:192.0.2.1:50000. Returns false if the call exceeds
  // the limit.
  bool take(const std::string& peer, schedule::Clock::time_point now, double cost = 1);

 private:
  AddressRate rate_{kCallsPerSecond, 2 * kCallsPerSecond};
};

}  // namespace clothstream::endpoint
