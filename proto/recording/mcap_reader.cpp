// SPDX-License-Identifier: MIT
// Reader of MCAP files: index or scan, then chunk by chunk.
#include "proto/recording/mcap_reader.h"

#include <algorithm>
#include <utility>

#include "proto/checksum/crc32.h"
#include "proto/recording/bytes.h"
#include "proto/recording/decompress.h"

namespace clothstream::recording {
namespace {

tl::unexpected<std::string> broken(std::string text) {
  return tl::unexpected(std::move(text));
}

using Done = tl::expected<void, std::string>;

// Bytes of all schemas and channels that are kept.
constexpr std::uint64_t kMaxDefinitionBytes = std::uint64_t{64} << 20;

// Record that ends the data, before the summary.
constexpr std::uint64_t kDataEndBytes = kRecordHead + 4;

struct Record {
  Opcode opcode{};
  std::uint64_t offset = 0;  // start of the content
  std::uint64_t length = 0;  // length of the content
  std::uint64_t end() const { return offset + length; }
};

// Fields of a chunk's record, without its messages.
struct ChunkHead {
  std::uint64_t start = 0, end = 0, size = 0;
  std::uint32_t crc = 0;
  std::string_view compression, records;
};

std::optional<ChunkHead> parseChunk(std::string_view content) {
  ByteReader reader(content);
  ChunkHead head;
  head.start = reader.number<std::uint64_t>();
  head.end = reader.number<std::uint64_t>();
  head.size = reader.number<std::uint64_t>();
  head.crc = reader.number<std::uint32_t>();
  head.compression = reader.text();
  head.records = reader.take(reader.number<std::uint64_t>());
  if (!reader.ok()) return std::nullopt;
  return head;
}

std::optional<Metadata> parseMap(std::string_view entries) {
  Metadata metadata;
  ByteReader reader(entries);
  while (reader.left() > 0) {
    std::string key(reader.text());
    metadata[std::move(key)] = std::string(reader.text());
  }
  if (!reader.ok()) return std::nullopt;
  return metadata;
}

}  // namespace

struct McapReader::State {
  std::unique_ptr<ByteSource> source;
  McapLimits limits;
  std::string library;
  std::uint64_t firstRecord = 0;  // offset after the header
  bool indexed = false;
  std::map<std::uint16_t, Channel> channels;
  std::map<std::uint16_t, ReadSchema> schemas;
  std::vector<ChunkPlace> chunks;
  std::optional<Statistics> statistics;
  std::map<std::string, Metadata> metadata;
  std::uint64_t metadataBytes = 0, definitionBytes = 0;  // read so far; definitions are schemas and channels
  std::uint64_t dataEnd = 0;
  std::uint64_t summaryStart = 0;  // only if there is an index

  // Buffers that are reused from chunk to chunk.
  std::string raw, records;
  std::vector<Message> messages;

  std::optional<Record> recordAt(std::uint64_t offset) const;
  bool content(const Record& record, std::uint64_t most, std::string& out) const;
  Done readStart();
  bool readSummary();
  bool takeSummaryRecord(Opcode opcode, std::string_view content);
  bool takeChunkIndex(std::string_view content);
  bool takeStatistics(std::string_view content);
  bool takeMetadataIndex(std::string_view content);
  bool takeSchema(std::string_view content);
  bool takeChannel(std::string_view content);
  bool takeMetadata(std::string_view content);
  void scan();
  bool scanChunk(const Record& record);
  bool chunksOverlap() const;
  Done checkExpansion() const;
  Done parseMessages(const ChunkHead& head);
};

std::optional<Record> McapReader::State::recordAt(std::uint64_t offset) const {
  const std::uint64_t size = source->size();
  std::string head;
  if (offset > size || size - offset < kRecordHead || !source->read(offset, kRecordHead, head))
    return std::nullopt;
  ByteReader reader(head);
  Record record{static_cast<Opcode>(reader.number<std::uint8_t>()), offset + kRecordHead, 0};
  record.length = reader.number<std::uint64_t>();
  if (record.opcode == Opcode{} || record.length > size - record.offset) return std::nullopt;
  return record;
}

bool McapReader::State::content(const Record& record, std::uint64_t most, std::string& out) const {
  return record.length <= most && source->read(record.offset, record.length, out);
}

Done McapReader::State::readStart() {
  std::string bytes;
  if (source->size() < kMagic.size() || !source->read(0, kMagic.size(), bytes))
    return broken("not an MCAP file: too short");
  if (bytes != kMagic) {
    std::string otherVersion(kMagic);
    otherVersion[kVersionByte] = bytes[kVersionByte];
    if (bytes == otherVersion)
      return broken("MCAP of version '" + bytes.substr(kVersionByte, 1) + "'; only version '0' can be read");
    return broken("not an MCAP file: wrong magic bytes");
  }
  const std::optional<Record> header = recordAt(kMagic.size());
  if (!header || header->opcode != Opcode::header || !content(*header, kMaxPlainRecordBytes, bytes))
    return broken("its header is missing or truncated");
  ByteReader reader(bytes);
  reader.text();
  library = reader.text();
  if (!reader.ok()) return broken("its header is invalid");
  firstRecord = dataEnd = header->end();
  return {};
}

bool McapReader::State::takeSchema(std::string_view content) {
  ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  ReadSchema schema;
  schema.name = reader.text();
  schema.encoding = reader.text();
  schema.data = reader.text();
  if (!reader.ok() || id == 0) return reader.ok();
  const auto [known, added] = schemas.try_emplace(id);
  // Chunks may repeat schemas, and are read several times.
  if (!added && known->second == schema) return true;
  known->second = std::move(schema);
  return (definitionBytes += content.size()) <= kMaxDefinitionBytes;
}

bool McapReader::State::takeChannel(std::string_view content) {
  ByteReader reader(content);
  Channel channel;
  channel.id = reader.number<std::uint16_t>();
  channel.schema = reader.number<std::uint16_t>();
  channel.topic = reader.text();
  channel.encoding = reader.text();
  reader.text();  // metadata of the channel
  if (!reader.ok()) return false;
  const auto [known, added] = channels.try_emplace(channel.id);
  if (!added && known->second == channel) return true;
  known->second = std::move(channel);
  return (definitionBytes += content.size()) <= kMaxDefinitionBytes;
}

bool McapReader::State::takeMetadata(std::string_view content) {
  ByteReader reader(content);
  std::string name(reader.text());
  std::optional<Metadata> map = parseMap(reader.text());
  if (!reader.ok() || !map) return false;
  metadata.insert_or_assign(std::move(name), std::move(*map));
  return true;
}

bool McapReader::State::takeChunkIndex(std::string_view content) {
  ByteReader reader(content);
  ChunkPlace place;
  place.start = reader.number<std::uint64_t>();
  place.end = reader.number<std::uint64_t>();
  place.offset = reader.number<std::uint64_t>();
  place.length = reader.number<std::uint64_t>();
  ByteReader indexes(reader.text());
  place.channels.emplace();
  while (indexes.left() > 0 && indexes.ok()) {
    place.channels->push_back(indexes.number<std::uint16_t>());
    indexes.number<std::uint64_t>();  // offset of its messages
  }
  reader.number<std::uint64_t>();  // length of the message indexes
  reader.text();                   // name of the compression
  reader.number<std::uint64_t>();  // compressed size
  place.size = reader.number<std::uint64_t>();
  const std::uint64_t size = source->size();
  if (!reader.ok() || !indexes.ok() || place.offset > size || place.length > size - place.offset ||
      place.length < kRecordHead)
    return false;
  chunks.push_back(std::move(place));
  return true;
}

bool McapReader::State::takeStatistics(std::string_view content) {
  ByteReader reader(content);
  Statistics& s = statistics.emplace();
  s.messages = reader.number<std::uint64_t>();
  reader.number<std::uint16_t>();  // schemas
  reader.number<std::uint32_t>();  // channels
  reader.number<std::uint32_t>();  // attachments
  reader.number<std::uint32_t>();  // metadata records
  s.chunks = reader.number<std::uint32_t>();
  s.start = reader.number<std::uint64_t>();
  s.end = reader.number<std::uint64_t>();
  ByteReader counts(reader.text());
  while (counts.left() > 0) {
    const auto channel = counts.number<std::uint16_t>();
    s.counts[channel] = counts.number<std::uint64_t>();
  }
  return reader.ok() && counts.ok();
}

bool McapReader::State::takeMetadataIndex(std::string_view content) {
  ByteReader reader(content);
  const auto offset = reader.number<std::uint64_t>();
  const std::optional<Record> record = reader.ok() ? recordAt(offset) : std::nullopt;
  // Several entries may name one record, so that a small file would be read again and again.
  if (!record || (metadataBytes += record->length) > source->size()) return false;
  std::string bytes;
  return record->opcode == Opcode::metadata && this->content(*record, kMaxPlainRecordBytes, bytes) &&
         takeMetadata(bytes);
}

bool McapReader::State::takeSummaryRecord(Opcode opcode, std::string_view content) {
  switch (opcode) {
    case Opcode::schema:
      return takeSchema(content);
    case Opcode::channel:
      return takeChannel(content);
    case Opcode::chunkIndex:
      return takeChunkIndex(content);
    case Opcode::statistics:
      return takeStatistics(content);
    case Opcode::metadataIndex:
      return takeMetadataIndex(content);
    default:
      return true;
  }
}

// False if there is no complete summary.
bool McapReader::State::readSummary() {
  constexpr std::uint64_t kEnd = kRecordHead + kFooterBytes + kMagic.size();
  const std::uint64_t size = source->size();
  std::string bytes;
  if (size < firstRecord + kEnd || !source->read(size - kMagic.size(), kMagic.size(), bytes) ||
      bytes != kMagic)
    return false;
  const std::uint64_t footerAt = size - kEnd;
  const std::optional<Record> footer = recordAt(footerAt);
  if (!footer || footer->opcode != Opcode::footer || !content(*footer, kFooterBytes, bytes)) return false;
  ByteReader reader(bytes);
  const auto start = reader.number<std::uint64_t>();
  reader.number<std::uint64_t>();  // offset of its message index
  const auto crc = reader.number<std::uint32_t>();
  if (!reader.ok() || start < firstRecord || start > footerAt || footerAt - start > kMaxSummaryBytes)
    return false;
  const std::uint64_t footerPart = kRecordHead + kFooterBytes - sizeof crc;
  if (!source->read(start, footerAt - start + footerPart, bytes)) return false;
  if (crc != 0 && checksum::crc32(bytes) != crc) return false;
  ByteReader summary(std::string_view(bytes).substr(0, static_cast<std::size_t>(footerAt - start)));
  while (summary.left() > 0) {
    const auto opcode = static_cast<Opcode>(summary.number<std::uint8_t>());
    const std::string_view record = summary.take(summary.number<std::uint64_t>());
    if (!summary.ok() || !takeSummaryRecord(opcode, record)) return false;
  }
  if (chunksOverlap()) return false;
  summaryStart = start;
  dataEnd = start - std::min(start, kDataEndBytes);
  return true;
}

bool McapReader::State::scanChunk(const Record& record) {
  constexpr std::uint64_t kTimesAndSize = 24;
  std::string bytes;
  if (record.length < kTimesAndSize || !source->read(record.offset, kTimesAndSize, bytes)) return false;
  ByteReader reader(bytes);
  ChunkPlace place;
  place.start = reader.number<std::uint64_t>();
  place.end = reader.number<std::uint64_t>();
  place.size = reader.number<std::uint64_t>();
  place.offset = record.offset - kRecordHead;
  place.length = record.length + kRecordHead;
  chunks.push_back(std::move(place));
  return true;
}

// Whether the index names bytes twice, so that a small file would have many large chunks.
bool McapReader::State::chunksOverlap() const {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> places;
  places.reserve(chunks.size());
  for (const ChunkPlace& chunk : chunks) places.emplace_back(chunk.offset, chunk.length);
  std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i)
    if (places[i].first - places[i - 1].first < places[i - 1].second) return true;
  return false;
}

Done McapReader::State::checkExpansion() const {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 50;  // so that the product fits
  std::uint64_t allowed =
      std::min(source->size(), kLargestFile) * limits.expansion + limits.chunkBytes * limits.freeChunks;
  for (const ChunkPlace& chunk : chunks) {
    if (chunk.size > limits.chunkBytes) continue;  // never decompressed
    if (chunk.size > allowed)
      return broken("its chunks would expand to more than " + std::to_string(limits.expansion) +
                    " times the size of the file plus " +
                    std::to_string(limits.chunkBytes * limits.freeChunks >> 20) + " MiB");
    allowed -= chunk.size;
  }
  return {};
}

void McapReader::State::scan() {
  std::string bytes;
  std::vector<std::uint16_t> named;  // from the message indexes after the last chunk
  for (std::uint64_t offset = firstRecord;;) {
    const std::optional<Record> record = recordAt(offset);
    if (!record) return;
    bool taken = true;
    if (record->opcode == Opcode::messageIndex) {
      taken = record->length >= sizeof(std::uint16_t) &&
              source->read(record->offset, sizeof(std::uint16_t), bytes);
      if (taken) named.push_back(ByteReader(bytes).number<std::uint16_t>());
    } else if (!named.empty()) {
      // Another record starts, so the list of message indexes is complete.
      if (!chunks.empty()) chunks.back().channels = named;
      named.clear();
    }
    if (record->opcode == Opcode::dataEnd || record->opcode == Opcode::footer) return;
    if (record->opcode == Opcode::chunk) taken = scanChunk(*record);
    const bool plain = record->opcode == Opcode::schema || record->opcode == Opcode::channel ||
                       record->opcode == Opcode::metadata;
    if (plain) {
      taken = content(*record, kMaxPlainRecordBytes, bytes);
      if (taken && record->opcode == Opcode::schema) taken = takeSchema(bytes);
      if (taken && record->opcode == Opcode::channel) taken = takeChannel(bytes);
      if (taken && record->opcode == Opcode::metadata) taken = takeMetadata(bytes);
    }
    if (!taken) return;
    dataEnd = offset = record->end();
  }
}

McapReader::McapReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
McapReader::~McapReader() = default;
McapReader::McapReader(McapReader&&) noexcept = default;

tl::expected<McapReader, std::string> McapReader::open(std::unique_ptr<ByteSource> source,
                                                       const McapLimits& limits) {
  auto state = std::make_unique<State>();
  state->limits = limits;
  state->source = std::move(source);
  if (Done started = state->readStart(); !started) return tl::unexpected(started.error());
  state->indexed = state->readSummary();
  if (!state->indexed) {
    auto scanned = std::make_unique<State>();
    scanned->source = std::move(state->source);
    scanned->limits = limits;
    scanned->library = state->library;
    scanned->firstRecord = scanned->dataEnd = state->firstRecord;
    scanned->scan();
    state = std::move(scanned);
  }
  std::stable_sort(state->chunks.begin(), state->chunks.end(),
                   [](const ChunkPlace& a, const ChunkPlace& b) { return a.start < b.start; });
  if (Done bounded = state->checkExpansion(); !bounded) return tl::unexpected(bounded.error());
  return McapReader(std::move(state));
}

bool McapReader::indexed() const {
  return state_->indexed;
}
const std::string& McapReader::library() const {
  return state_->library;
}
const std::map<std::uint16_t, Channel>& McapReader::channels() const {
  return state_->channels;
}
const std::map<std::uint16_t, ReadSchema>& McapReader::schemas() const {
  return state_->schemas;
}
std::span<const ChunkPlace> McapReader::chunks() const {
  return state_->chunks;
}
const std::optional<Statistics>& McapReader::statistics() const {
  return state_->statistics;
}
std::uint64_t McapReader::bytes() const {
  return state_->source->size();
}
std::uint64_t McapReader::dataEnd() const {
  return state_->dataEnd;
}

const Metadata* McapReader::metadata(const std::string& name) const {
  const auto found = state_->metadata.find(name);
  return found == state_->metadata.end() ? nullptr : &found->second;
}

std::size_t McapReader::chunkAt(std::uint64_t time) const {
  const auto after =
      std::upper_bound(state_->chunks.begin(), state_->chunks.end(), time,
                       [](std::uint64_t sought, const ChunkPlace& chunk) { return sought < chunk.start; });
  const auto count = static_cast<std::size_t>(after - state_->chunks.begin());
  return count == 0 ? 0 : count - 1;
}

Done McapReader::State::parseMessages(const ChunkHead& head) {
  messages.clear();
  ByteReader reader(records);
  while (reader.left() > 0) {
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    const std::string_view content = reader.take(reader.number<std::uint64_t>());
    if (!reader.ok()) return broken("a record reaches past its end");
    if (opcode == Opcode::schema && !takeSchema(content)) return broken("a schema in it is invalid");
    if (opcode == Opcode::channel && !takeChannel(content)) return broken("a channel in it is invalid");
    if (opcode != Opcode::message) continue;
    if (messages.size() == kMaxChunkMessages)
      return broken("it has more than " + std::to_string(kMaxChunkMessages) + " messages");
    ByteReader fields(content);
    Message& message = messages.emplace_back();
    message.channel = fields.number<std::uint16_t>();
    fields.number<std::uint32_t>();  // number in the channel
    message.time = fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();  // time of publication
    if (!fields.ok()) return broken("a message in it is too short");
    message.bytes = fields.rest();
    if (!channels.contains(message.channel))
      return broken("a message in it belongs to the unknown channel " + std::to_string(message.channel));
    if (message.time < head.start || message.time > head.end)
      return broken("a message in it is outside of its time range");
  }
  return {};
}

tl::expected<std::span<const Message>, std::string> McapReader::read(std::size_t chunk) {
  State& s = *state_;
  const ChunkPlace& place = s.chunks[chunk];
  const auto wrong = [&](std::string_view what) {
    return broken("the chunk at byte " + std::to_string(place.offset) +
                  " cannot be read: " + std::string(what));
  };
  const std::optional<Record> record = s.recordAt(place.offset);
  if (!record || record->opcode != Opcode::chunk || record->length != place.length - kRecordHead)
    return wrong("there is none");
  if (place.size > s.limits.chunkBytes)
    return wrong("it has " + std::to_string(place.size) + " bytes; chunks of at most " +
                 std::to_string(s.limits.chunkBytes) + " are read (--max-vertices allows more)");
  if (!s.content(*record, s.limits.chunkBytes, s.raw))
    return wrong("it is too large, or its bytes cannot be read");
  const std::optional<ChunkHead> head = parseChunk(s.raw);
  if (!head) return wrong("it is too short");
  if (head->size != place.size) return wrong("it has another size than its index says");
  if (head->compression.empty()) {
    if (head->records.size() != head->size) return wrong("it has another size than it says");
    s.records = head->records;
  } else if (head->compression == "zstd") {
    if (!decompressZstd(head->records, head->size, s.records))
      return wrong("its compressed bytes are damaged, or have another size than it says");
  } else {
    return wrong("it is compressed by '" + std::string(head->compression.substr(0, 16)) +
                 "', and zstd is what can be read");
  }
  if (head->crc != 0 && checksum::crc32(s.records) != head->crc) return wrong("its checksum does not match");
  if (Done parsed = s.parseMessages(*head); !parsed) return wrong(parsed.error());
  return std::span<const Message>(s.messages);
}

Done McapReader::check() {
  State& s = *state_;
  if (!s.indexed) return broken("it has no index: it is truncated or damaged at its end");
  Statistics found;
  for (std::size_t i = 0; i < s.chunks.size(); ++i) {
    const auto messages = read(i);
    if (!messages) return tl::unexpected(messages.error());
    for (const Message& message : *messages) ++found.counts[message.channel];
    found.messages += messages->size();
  }
  if (s.statistics && (s.statistics->messages != found.messages || s.statistics->chunks != s.chunks.size() ||
                       s.statistics->counts != found.counts))
    return broken("its statistics count " + std::to_string(s.statistics->messages) + " messages in " +
                  std::to_string(s.statistics->chunks) + " chunks, but it has " +
                  std::to_string(found.messages) + " in " + std::to_string(s.chunks.size()));
  const std::optional<Record> end = s.recordAt(s.dataEnd);
  std::string bytes;
  if (!end || end->opcode != Opcode::dataEnd || end->end() != s.summaryStart ||
      !s.content(*end, kDataEndBytes, bytes))
    return broken("its data has no end record");
  const auto stated = ByteReader(bytes).number<std::uint32_t>();
  std::uint32_t crc = 0;
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;
  for (std::uint64_t offset = 0; offset < s.dataEnd; offset += kPiece) {
    if (!s.source->read(offset, std::min(kPiece, s.dataEnd - offset), bytes))
      return broken("the bytes from " + std::to_string(offset) + " on cannot be read");
    crc = checksum::crc32(bytes, crc);
  }
  if (stated != 0 && stated != crc) return broken("the checksum of its data does not match");
  return {};
}

}  // namespace clothstream::recording
