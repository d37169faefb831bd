// SPDX-License-Identifier: MIT
// Writer of MCAP files: messages of channels, in compressed chunks with an index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "proto/recording/mcap_format.h"

namespace clothstream::recording {

// Takes the next bytes of the file. The error says what went wrong.
using Sink = std::function<tl::expected<void, std::string>(std::string_view)>;
using Written = tl::expected<void, std::string>;

// Schema of protobuf messages.
struct Schema {
  std::string name;  // full name of the message
  std::string data;  // serialised FileDescriptorSet
};

// Not thread-safe. After an error of the sink nothing more is written, and every call returns that error.
class McapWriter {
 public:
  // Limits of a chunk: it is closed before it spans more time, and as soon as it holds this many bytes.
  static constexpr std::uint64_t kChunkNs = 200'000'000;
  static constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

  explicit McapWriter(Sink sink);
  ~McapWriter();
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) = delete;

  // The first call, made once.
  [[nodiscard]] Written begin(std::string_view library);
  // Returns the channel's number. A channel must be added before its messages.
  [[nodiscard]] tl::expected<std::uint16_t, std::string> addChannel(std::string_view topic,
                                                                    const Schema& schema);
  [[nodiscard]] Written addMetadata(std::string_view name, const Metadata& metadata);
  // A time before that of the last message is raised to it, so that messages are ordered by time.
  [[nodiscard]] Written write(std::uint16_t channel, std::uint64_t logTimeNs, std::string_view message);
  // Passes everything written so far to the sink.
  [[nodiscard]] Written closeChunk();
  // Closes the chunk and writes the index and the end. The last call, made once.
  [[nodiscard]] Written finish();

  // Bytes that the sink has taken.
  std::uint64_t bytes() const;
  std::uint64_t messages() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::recording
