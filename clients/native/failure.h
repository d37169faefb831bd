// SPDX-License-Identifier: MIT
// Reason why a stream could not start or has ended.
#pragma once

#include <string>

namespace clothstream {

struct Failure {
  enum class Kind {
    unreachable,  // no server answers at the address in time
    refused,      // the server refuses: unknown scene, version, full
    lost,         // the stream ended although the client had not left
  };
  Kind kind = Kind::lost;
  // Text for users, with the address and advice.
  std::string text;
  // The server requires another token, or a pairing code.
  bool needsProof = false;
};

}  // namespace clothstream
