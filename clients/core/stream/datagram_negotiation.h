// SPDX-License-Identifier: MIT
// What the client has offered and the server has answered about datagrams on one connection.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "clients/core/wire/datagram_offer.h"

namespace clothstream::client {

class DatagramNegotiation {
 public:
  // A connection begins, or ends. Offer and answer belong to one connection.
  void connecting() { begin(true); }
  void disconnected() { begin(false); }
  // Whether there is a connection, which may still be opening.
  bool mayOffer() const { return connected_; }

  // The client sends an offer with this request id, which is not 0.
  void offered(std::uint64_t requestId) {
    offerId_ = requestId;
    answer_.reset();
  }
  // Returns false for an answer to no offer.
  bool answered(DatagramAnswer answer) {
    if (offerId_ == 0) return false;
    answer_ = std::move(answer);
    return true;
  }
  // Whether the server has refused the offer: it does not know datagrams. This is like an empty answer.
  bool refused(std::uint64_t requestId) {
    return requestId != 0 && requestId == offerId_ && answered(DatagramAnswer{});
  }
  const std::optional<DatagramAnswer>& answer() const { return answer_; }
  // Whether the server opens datagrams for this connection, if they arrive.
  bool serverOpens() const { return answer_ && !answer_->addresses.empty(); }

 private:
  void begin(bool connected) {
    connected_ = connected;
    offerId_ = 0;
    answer_.reset();
  }

  bool connected_ = true;
  std::uint64_t offerId_ = 0;  // of the newest offer; 0: there is none
  std::optional<DatagramAnswer> answer_;
};

}  // namespace clothstream::client
