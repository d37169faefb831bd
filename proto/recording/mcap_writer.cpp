// SPDX-License-Identifier: MIT
// Writer of MCAP files: records, chunk by chunk.
#include "proto/recording/mcap_writer.h"

#include <algorithm>
#include <utility>

#include <zstd.h>

#include "proto/checksum/crc32.h"
#include "proto/recording/bytes.h"

namespace clothstream::recording {
namespace {

// Frames are already entropy-coded; only ticks and states shrink.
constexpr int kCompressionLevel = 1;
constexpr const char* kCompression = "zstd";

void appendRecord(std::string& out, Opcode opcode, std::string_view content) {
  appendNumber(out, static_cast<std::uint8_t>(opcode));
  appendNumber(out, std::uint64_t{content.size()});
  out += content;
}

std::string mapOf(const Metadata& metadata) {
  std::string entries, out;
  for (const auto& [key, value] : metadata) {
    appendText(entries, key);
    appendText(entries, value);
  }
  appendText(out, entries);
  return out;
}

std::string mapOf(const std::map<std::uint16_t, std::uint64_t>& numbers) {
  std::string entries, out;
  for (const auto& [key, value] : numbers) {
    appendNumber(entries, key);
    appendNumber(entries, value);
  }
  appendText(out, entries);
  return out;
}

}  // namespace

struct McapWriter::State {
  explicit State(Sink sink_) : sink(std::move(sink_)) {}

  Written put(std::string_view bytes) {
    if (!outcome) return outcome;
    outcome = sink(bytes);
    if (!outcome) return outcome;
    crc = checksum::crc32(bytes, crc);
    offset += bytes.size();
    return {};
  }
  Written put(Opcode opcode, std::string_view content) {
    std::string bytes;
    appendRecord(bytes, opcode, content);
    return put(bytes);
  }
  // Writes a group of the summary.
  Written put(Opcode opcode, const std::vector<std::string>& contents) {
    if (contents.empty()) return outcome;
    std::string records;
    for (const std::string& content : contents) appendRecord(records, opcode, content);
    appendNumber(offsets, static_cast<std::uint8_t>(Opcode::summaryOffset));
    appendNumber(offsets, std::uint64_t{1 + 8 + 8});
    appendNumber(offsets, static_cast<std::uint8_t>(opcode));
    appendNumber(offsets, offset);
    appendNumber(offsets, std::uint64_t{records.size()});
    return put(records);
  }
  std::string statistics() const;
  Written writeSummary();

  Sink sink;
  Written outcome;
  std::uint64_t offset = 0;
  std::uint32_t crc = 0;  // of all bytes so far, or of the bytes of the summary

  std::vector<std::string> schemas, channels, chunkIndexes, metadataIndexes;  // contents of records
  std::string offsets;                                                        // records
  std::uint64_t messages = 0;
  std::uint64_t firstTime = 0, lastTime = 0;  // of all messages, in ns
  std::map<std::uint16_t, std::uint64_t> counts;

  std::string chunk;  // messages of the open chunk
  std::uint64_t chunkStart = 0;
  std::map<std::uint16_t, std::string> index;  // of the open chunk: times and offsets
  std::string compressed, record;              // reused for every chunk
};

McapWriter::McapWriter(Sink sink) : state_(std::make_unique<State>(std::move(sink))) {}
McapWriter::~McapWriter() = default;
McapWriter::McapWriter(McapWriter&&) noexcept = default;

std::uint64_t McapWriter::bytes() const {
  return state_->offset;
}

std::uint64_t McapWriter::messages() const {
  return state_->messages;
}

Written McapWriter::begin(std::string_view library) {
  std::string content;
  appendText(content, "");  // profile: none of the well-known ones
  appendText(content, library);
  return state_->put(kMagic).and_then([&] { return state_->put(Opcode::header, content); });
}

tl::expected<std::uint16_t, std::string> McapWriter::addChannel(std::string_view topic,
                                                                const Schema& schema) {
  State& s = *state_;
  const auto id = static_cast<std::uint16_t>(s.channels.size() + 1);
  std::string schemaContent, channelContent;
  appendNumber(schemaContent, id);
  appendText(schemaContent, schema.name);
  appendText(schemaContent, "protobuf");
  appendText(schemaContent, schema.data);
  appendNumber(channelContent, id);
  appendNumber(channelContent, id);
  appendText(channelContent, topic);
  appendText(channelContent, "protobuf");
  channelContent += mapOf(Metadata{});
  // Schemas stand outside of chunks, so that losing a chunk does not affect the meaning of others.
  return s.put(Opcode::schema, schemaContent)
      .and_then([&] { return s.put(Opcode::channel, channelContent); })
      .map([&] {
        s.schemas.push_back(std::move(schemaContent));
        s.channels.push_back(std::move(channelContent));
        return id;
      });
}

Written McapWriter::addMetadata(std::string_view name, const Metadata& metadata) {
  State& s = *state_;
  std::string content;
  appendText(content, name);
  content += mapOf(metadata);
  std::string& index = s.metadataIndexes.emplace_back();
  appendNumber(index, s.offset);
  appendNumber(index, std::uint64_t{kRecordHead + content.size()});
  appendText(index, name);
  return s.put(Opcode::metadata, content);
}

Written McapWriter::write(std::uint16_t channel, std::uint64_t logTimeNs, std::string_view message) {
  State& s = *state_;
  const std::uint64_t time = std::max(logTimeNs, s.lastTime);
  if (!s.index.empty() && time - s.chunkStart >= kChunkNs)
    if (auto closed = closeChunk(); !closed) return closed;
  if (s.index.empty()) s.chunkStart = time;
  if (s.messages == 0) s.firstTime = time;
  s.lastTime = time;
  ++s.messages;
  std::string& index = s.index[channel];
  appendNumber(index, time);
  appendNumber(index, std::uint64_t{s.chunk.size()});
  appendNumber(s.chunk, static_cast<std::uint8_t>(Opcode::message));
  appendNumber(s.chunk, std::uint64_t{2 + 4 + 8 + 8 + message.size()});
  appendNumber(s.chunk, channel);
  appendNumber(s.chunk, static_cast<std::uint32_t>(s.counts[channel]++));
  appendNumber(s.chunk, time);
  appendNumber(s.chunk, time);
  s.chunk += message;
  return s.chunk.size() >= kChunkBytes ? closeChunk() : s.outcome;
}

Written McapWriter::closeChunk() {
  State& s = *state_;
  if (s.index.empty() || !s.outcome) return s.outcome;
  s.compressed.resize(ZSTD_compressBound(s.chunk.size()));
  const std::size_t size = ZSTD_compress(s.compressed.data(), s.compressed.size(), s.chunk.data(),
                                         s.chunk.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) return s.outcome = tl::unexpected(std::string(ZSTD_getErrorName(size)));

  // A chunk and its message indexes are written in one call, so the sink gets all of them or the file ends in
  // this chunk.
  std::string content;
  appendNumber(content, s.chunkStart);
  appendNumber(content, s.lastTime);
  appendNumber(content, std::uint64_t{s.chunk.size()});
  appendNumber(content, checksum::crc32(s.chunk));
  appendText(content, kCompression);
  appendNumber(content, std::uint64_t{size});
  content.append(s.compressed, 0, size);
  s.record.clear();
  appendRecord(s.record, Opcode::chunk, content);
  const std::uint64_t chunkBytes = s.record.size();
  std::map<std::uint16_t, std::uint64_t> indexOffsets;
  for (const auto& [channel, entries] : s.index) {
    indexOffsets[channel] = s.offset + s.record.size();
    content.clear();
    appendNumber(content, channel);
    appendText(content, entries);
    appendRecord(s.record, Opcode::messageIndex, content);
  }

  std::string& index = s.chunkIndexes.emplace_back();
  appendNumber(index, s.chunkStart);
  appendNumber(index, s.lastTime);
  appendNumber(index, s.offset);
  appendNumber(index, chunkBytes);
  index += mapOf(indexOffsets);
  appendNumber(index, std::uint64_t{s.record.size() - chunkBytes});
  appendText(index, kCompression);
  appendNumber(index, std::uint64_t{size});
  appendNumber(index, std::uint64_t{s.chunk.size()});
  s.chunk.clear();
  s.index.clear();
  return s.put(s.record);
}

std::string McapWriter::State::statistics() const {
  std::string out;
  appendNumber(out, messages);
  appendNumber(out, static_cast<std::uint16_t>(schemas.size()));
  appendNumber(out, static_cast<std::uint32_t>(channels.size()));
  appendNumber(out, std::uint32_t{0});  // attachments
  appendNumber(out, static_cast<std::uint32_t>(metadataIndexes.size()));
  appendNumber(out, static_cast<std::uint32_t>(chunkIndexes.size()));
  appendNumber(out, firstTime);
  appendNumber(out, lastTime);
  out += mapOf(counts);
  return out;
}

Written McapWriter::State::writeSummary() {
  const std::uint64_t start = offset;
  crc = 0;
  return put(Opcode::schema, schemas)
      .and_then([&] { return put(Opcode::channel, channels); })
      .and_then([&] { return put(Opcode::statistics, std::vector{statistics()}); })
      .and_then([&] { return put(Opcode::chunkIndex, chunkIndexes); })
      .and_then([&] { return put(Opcode::metadataIndex, metadataIndexes); })
      .and_then([&] {
        const std::uint64_t offsetsStart = offset;
        std::string footer;
        appendNumber(footer, static_cast<std::uint8_t>(Opcode::footer));
        appendNumber(footer, std::uint64_t{kFooterBytes});
        appendNumber(footer, start);
        appendNumber(footer, offsetsStart);
        appendNumber(footer, checksum::crc32(footer, checksum::crc32(offsets, crc)));
        return put(offsets + footer + std::string(kMagic));
      });
}

Written McapWriter::finish() {
  return closeChunk()
      .and_then([&] {
        std::string content;
        appendNumber(content, state_->crc);
        return state_->put(Opcode::dataEnd, content);
      })
      .and_then([&] { return state_->writeSummary(); });
}

}  // namespace clothstream::recording
