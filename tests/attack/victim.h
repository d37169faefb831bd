// SPDX-License-Identifier: MIT
// An honest client that counts the frames that it receives.
#pragma once

#include <cstdint>
#include <memory>

#include "clients/native/address.h"

namespace clothstream::attack {

// Watches the default scene until its destruction.
class Victim {
 public:
  enum class Endpoint : std::uint8_t { grpc, web };

  // `datagrams`: it has joined when datagrams are open; else it uses none. Throws std::runtime_error if it
  // cannot join.
  Victim(const ServerAddress& address, Endpoint endpoint, bool datagrams);
  ~Victim();
  Victim(const Victim&) = delete;
  Victim& operator=(const Victim&) = delete;

  // Counts from now on.
  void begin();

  struct Seen {
    double framesPerSecond = 0;
    double longestGap = 0;   // s, without a frame
    double inDatagrams = 0;  // share of the frames, 0 to 1
  };
  // Figures since begin().
  Seen seen() const;

 private:
  class Counts;
  class Client;
  std::unique_ptr<Counts> counts_;
  std::unique_ptr<Client> client_;  // counts until it ends
  std::uint64_t datagramsBefore_ = 0;
};

}  // namespace clothstream::attack
