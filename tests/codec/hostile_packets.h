// SPDX-License-Identifier: MIT
// Promises of the decoder that mutated packets check, for bytes from any source.
#pragma once

#include <cstddef>
#include <span>

#include "tests/codec/golden.h"

namespace clothstream::codec {

// Feeds a decoder the stream's packets, with `bytes` instead of packet `place`. Aborts if the decoder breaks
// a promise: a refused packet changed its state, a coordinate or normal is not finite, or a later key frame
// cannot be decoded.
void decodeHostile(const GoldenStream& stream, std::size_t place, std::span<const std::byte> bytes);

}  // namespace clothstream::codec
