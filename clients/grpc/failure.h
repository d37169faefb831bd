// SPDX-License-Identifier: MIT
// Why there is no stream, or no more of it.
#pragma once

#include <string>

namespace clothstream {

struct Failure {
  enum class Kind {
    unreachable,  // nobody answers at the address, or not in time
    refused,      // the server said no: unknown scene, version, full
    lost,         // there was a stream, and it ended without being asked to
  };
  Kind kind = Kind::lost;
  // A sentence for people, with the address and what to do.
  std::string text;
};

}  // namespace clothstream
