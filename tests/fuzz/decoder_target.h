// SPDX-License-Identifier: MIT
// What fuzzing asks of the decoder, whoever makes up the bytes.
#pragma once

#include <cstddef>
#include <span>

#include "tests/codec/golden.h"

namespace clothstream::codec {

// Feeds a decoder the stream's packets, but `bytes` in the place of packet `place`, and after it what comes
// next. Aborts where the decoder breaks a promise: its state changed by a packet that it refused, a
// coordinate or normal that is not finite, or a key frame that it does not decode afterwards.
void decodeHostile(const GoldenStream& stream, std::size_t place, std::span<const std::byte> bytes);

}  // namespace clothstream::codec
