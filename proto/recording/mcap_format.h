// SPDX-License-Identifier: MIT
// Definitions that MCAP readers and writers share: https://mcap.dev/spec.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace clothstream::recording {

enum class Opcode : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  messageIndex = 7,
  chunkIndex = 8,
  statistics = 11,
  metadata = 12,
  metadataIndex = 13,
  summaryOffset = 14,
  dataEnd = 15,
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kVersionByte = 5;     // place in the magic
inline constexpr std::size_t kRecordHead = 1 + 8;  // opcode, length
inline constexpr std::size_t kFooterBytes = 8 + 8 + 4;

// Limits of a reader. McapLimits has those that depend on its caller.
inline constexpr std::uint64_t kMaxSummaryBytes = std::uint64_t{256} << 20;
inline constexpr std::uint64_t kMaxPlainRecordBytes = std::uint64_t{16} << 20;  // schema, channel, metadata
inline constexpr std::size_t kMaxChunkMessages = 262'144;

using Metadata = std::map<std::string, std::string>;

}  // namespace clothstream::recording
