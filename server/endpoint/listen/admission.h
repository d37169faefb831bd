// SPDX-License-Identifier: MIT
// Decides which connections an endpoint accepts.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <boost/asio/ip/address.hpp>
#include <tl/expected.hpp>

#include "server/schedule/clock.h"
#include "server/telemetry/metrics.h"

namespace clothstream::endpoint {

struct ConnectionLimits {
  std::size_t connections = 256;           // open at a time
  std::size_t connectionsPerAddress = 64;  // of one address
  // Rates of new connections. The burst of each is the number of one second.
  double connectionsPerSecond = 200;
  double connectionsPerSecondOfAddress = 20;
};

// Thread-safe. Addresses count by their key (addressKey). All programs of this machine share the loopback
// addresses, which therefore have no limit of their own.
class Admission {
 public:
  // Counts one connection while it lives. It may outlive the Admission.
  class Ticket {
   public:
    Ticket(Ticket&&) noexcept = default;
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket();

    // Key of the address (addressKey).
    const std::string& address() const { return address_; }

   private:
    friend class Admission;
    struct Counts;
    Ticket(std::shared_ptr<Counts> counts, std::string address)
        : counts_(std::move(counts)), address_(std::move(address)) {}
    std::shared_ptr<Counts> counts_;  // null after a move
    std::string address_;             // empty for loopback
  };

  explicit Admission(const ConnectionLimits& limits);
  ~Admission();

  tl::expected<Ticket, telemetry::Refusal> admit(const boost::asio::ip::address& address,
                                                 schedule::Clock::time_point now);
  std::size_t connections() const;

 private:
  const std::shared_ptr<Ticket::Counts> counts_;
};

}  // namespace clothstream::endpoint
