// SPDX-License-Identifier: MIT
// Header of an array of numpy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace clothstream::files {

struct NpyHeader {
  std::string type;                  // as numpy writes it: "<f4", "<u8"
  std::vector<std::uint64_t> shape;  // rows first; empty for a single number

  // Bytes of one element: the number at the end of `type`, four times that for text ("<U8").
  std::size_t elementBytes() const;
  // Number of elements in one row, and in all rows. parseNpyHeader() ensures that they fit.
  std::uint64_t rowElements() const;
  std::uint64_t elements() const;
  std::uint64_t bytes() const { return elements() * elementBytes(); }
};

// First bytes of every array.
inline constexpr std::string_view kNpyMagic{"\x93NUMPY", 6};
// Bytes in front of a header: magic, version and, for version 1, its length.
inline constexpr std::size_t kNpyPreambleBytes = 10;
// Largest header that is accepted.
inline constexpr std::size_t kMaxNpyHeaderBytes = 4096;

// Returns magic, version 1.0 and header, padded to exactly this many bytes, or to a multiple of 64 if it is
// 0.
std::string npyHeader(const NpyHeader& header, std::size_t bytes = 0);

// Parses the dictionary of a header. Accepts C order, little-endian numbers, and text. The error says what is
// not accepted and what to do. Safe on any text.
[[nodiscard]] tl::expected<NpyHeader, std::string> parseNpyHeader(std::string_view dictionary);

}  // namespace clothstream::files
