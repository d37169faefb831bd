// SPDX-License-Identifier: MIT
// State of the connection for the user, and the time of the next attempt. No sockets, clocks or threads.
#pragma once

#include <cstdint>
#include <string>

#include <clothstream/clothstream.h>

namespace clothstream::xr {

enum class Phase : std::uint8_t {
  connecting,    // an attempt to join is under way
  live,          // frames arrive
  reconnecting,  // the connection is lost, and libclothstream opens it again
  waiting,       // the next attempt follows by itself
  refused        // the server or the arguments do not allow it; a user must do something
};

// Step that failed: exchanging the pairing code, joining, or a stream that has run.
enum class Step : std::uint8_t { pairing, joining, streaming };

struct Trouble {
  std::string title, advice;  // sentences; "" if all is well
  bool operator==(const Trouble&) const = default;
};

// Says what a result means for the user. `text` is the error of the library.
Trouble troubleOf(Step step, clothstream_result result, const std::string& text);
// Says that the connection is lost and is being opened again.
Trouble lostTrouble(const std::string& address);

// Whether another attempt can succeed without a change of the options.
bool retriesByItself(clothstream_result result);

// Time before the next attempt: 1 s after the first failure, then twice as long each time, at most 8 s.
std::uint64_t retryDelayUs(std::uint32_t failures);

}  // namespace clothstream::xr
