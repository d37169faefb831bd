// SPDX-License-Identifier: MIT
// What sessions know of datagrams: the gate that opens them for a peer.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/link_outlet.h"
#include "server/messages/datagram_offer.h"

namespace clothstream::hosting {

// A peer that offers datagrams.
struct DatagramPeer {
  std::string name;  // for logs
  // Address of this machine that the peer's stream has reached; empty: not known.
  std::string reached;
  messages::DatagramOffer offer;
  // Its frames are taken by nextFrame().
  std::shared_ptr<delivery::LinkOutlet> outlet;
  // Takes a ClientMessage that came in a datagram. Called on a thread of the gate.
  std::function<void(std::span<const std::byte> message)> receive;
};

// Thread-safe.
class DatagramGate {
 public:
  virtual ~DatagramGate() = default;

  struct Opened {
    v1::DatagramAnswer answer;
    std::shared_ptr<const void> association;  // datagrams end, soon after, when this is released
  };
  // Waits for the peer's datagrams. Nothing if there are too many peers. Does not block, and calls neither
  // outlet nor `receive` before it returns.
  [[nodiscard]] virtual std::optional<Opened> open(DatagramPeer peer) = 0;
};

}  // namespace clothstream::hosting
