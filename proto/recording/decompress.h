// SPDX-License-Identifier: MIT
// Decompression of a chunk. The native library uses zstd; WebAssembly calls its host.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace clothstream::recording {

// Decompresses one zstd frame into `out`, which gets exactly `size` bytes. Returns false if the frame has
// another size or is damaged. Safe on any bytes.
[[nodiscard]] bool decompressZstd(std::string_view frame, std::uint64_t size, std::string& out);

}  // namespace clothstream::recording
