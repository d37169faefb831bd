// SPDX-License-Identifier: MIT
// Writes MCAP: messages of channels, in compressed chunks with an index.
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

// Takes bytes that follow those before. The error says what went wrong.
using Sink = std::function<tl::expected<void, std::string>(std::string_view)>;
using Written = tl::expected<void, std::string>;

// Of protobuf messages.
struct Schema {
  std::string name;  // of the message, in full
  std::string data;  // a serialised FileDescriptorSet
};

// Not thread-safe. After an error of the sink nothing more is written, and every call returns that error.
class McapWriter {
 public:
  // A chunk is closed before it holds messages of more time, and when it holds as many bytes.
  static constexpr std::uint64_t kChunkNs = 200'000'000;
  static constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

  explicit McapWriter(Sink sink);
  ~McapWriter();
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) = delete;

  // First of all, once.
  [[nodiscard]] Written begin(std::string_view library);
  // Gives the channel's number. Channels come before their messages.
  [[nodiscard]] tl::expected<std::uint16_t, std::string> addChannel(std::string_view topic,
                                                                    const Schema& schema);
  [[nodiscard]] Written addFacts(std::string_view name, const Facts& facts);
  // A time before that of the last message counts as that: messages are in the order of their times.
  [[nodiscard]] Written write(std::uint16_t channel, std::uint64_t logTimeNs, std::string_view message);
  // What was written so far is with the sink then.
  [[nodiscard]] Written closeChunk();
  // Closes the chunk, writes index and end. Once, and nothing after it.
  [[nodiscard]] Written finish();

  // With the sink.
  std::uint64_t bytes() const;
  std::uint64_t messages() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::recording
