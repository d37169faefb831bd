// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/call_rate.h"

#include "server/endpoint/grpc/caller.h"

namespace clothstream::endpoint {

bool CallRate::take(const std::string& peer, schedule::Clock::time_point now, double cost) {
  return rate_.take(addressKeyOf(peer), now, cost);
}

}  // namespace clothstream::endpoint
