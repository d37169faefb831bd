// SPDX-License-Identifier: MIT
// Endpoint for datagrams: frames down, input up, next to the streams of the other endpoints.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/hosting/datagram_gate.h"

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

struct DatagramEndpointOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  // 0: a free port
  // Addresses of this machine for peers of whose stream the address is not known.
  std::vector<std::string> ownAddresses{};
  // Addresses under which others reach this machine, such as that of a router that forwards the port.
  std::vector<std::string> publicAddresses{};
  // Peers at a time. Further ones stay on their streams.
  std::size_t maxPeers = 512;
};

// Opens one UDP port, and is the gate of the server while it lives. It has one thread. Peers, of which
// sessions learn first, prove their addresses and themselves (docs/datagram-security.md).
class DatagramEndpoint final : public hosting::DatagramGate {
 public:
  // Throws std::runtime_error if the port cannot be opened. `server` must outlive the endpoint.
  DatagramEndpoint(hosting::SceneServer& server, const DatagramEndpointOptions& options);
  // Frames of all peers leave by their streams again. The sessions of its peers must have ended, or open no
  // datagrams any more.
  ~DatagramEndpoint() override;
  DatagramEndpoint(const DatagramEndpoint&) = delete;
  DatagramEndpoint& operator=(const DatagramEndpoint&) = delete;

  std::uint16_t port() const;

  [[nodiscard]] std::optional<Opened> open(hosting::DatagramPeer peer) override;

 private:
  struct State;
  // Associations may be released after the end of the endpoint.
  const std::shared_ptr<State> state_;
  hosting::SceneServer& server_;
};

}  // namespace clothstream::endpoint
