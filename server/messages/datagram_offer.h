// SPDX-License-Identifier: MIT
// Offer of a peer to exchange datagrams.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"

namespace clothstream::messages {

// Checked: credentials of ICE, and the fingerprint of the peer's certificate.
struct DatagramOffer {
  std::string ufrag, password;
  std::string fingerprint;  // SHA-256, 32 bytes
  bool sctp = false;        // a data channel over DTLS, not records alone
};

[[nodiscard]] Result<DatagramOffer> toDatagramOffer(const v1::DatagramOffer& message);

}  // namespace clothstream::messages
