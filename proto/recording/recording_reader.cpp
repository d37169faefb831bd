// SPDX-License-Identifier: MIT
// Reader of recordings, chunk by chunk.
#include "proto/recording/recording_reader.h"

#include <algorithm>
#include <span>
#include <utility>

#include <protozero/pbf_reader.hpp>

#include "proto/codec/packet_header.h"
#include "proto/wire/message_structure.h"

namespace clothstream::recording {

std::optional<FrameContent> frameContentOf(std::string_view bytes) {
  if (!wellFormed(bytes)) return std::nullopt;
  using protozero::pbf_wire_type;
  FrameContent content;
  protozero::pbf_reader frame(bytes.data(), bytes.size());
  while (frame.next()) {
    switch (frame.tag_and_type()) {
      case protozero::tag_and_type(kFramePacket, pbf_wire_type::length_delimited): {
        const protozero::data_view view = frame.get_view();
        content.packet = std::as_bytes(std::span(view.data(), view.size()));
        break;
      }
      case protozero::tag_and_type(kFrameReconstructionHash, pbf_wire_type::fixed64):
        content.reconstructionHash = frame.get_fixed64();
        break;
      default:
        frame.skip();
    }
  }
  return content;
}

bool isKeyFrame(std::string_view bytes) {
  const std::optional<FrameContent> frame = frameContentOf(bytes);
  const auto parsed = frame ? codec::parsePacket(frame->packet) : std::nullopt;
  return parsed && parsed->header.kind == codec::PacketKind::key;
}

tl::unexpected<std::string> RecordingReader::broken(std::string_view what) const {
  return tl::unexpected(name_ + " is broken: " + std::string(what));
}

std::string ReadLimits::problemOf(std::uint64_t vertexCount, std::uint64_t triangleCount) const {
  const std::uint64_t most = vertices;
  const bool tooManyVertices = vertexCount > most;
  if (!tooManyVertices && triangleCount <= 2 * most) return {};
  return std::to_string(tooManyVertices ? vertexCount : triangleCount) +
         (tooManyVertices ? " vertices; at most " : " triangles; at most ") +
         std::to_string(tooManyVertices ? most : 2 * most) + " are read (--max-vertices allows more)";
}

tl::expected<RecordingReader, std::string> RecordingReader::open(const std::string& path, CutFiles cutFiles,
                                                                 const ReadLimits& limits) {
  auto file = openFile(path);
  if (!file) return tl::unexpected(file.error());
  return open(std::move(*file), path, cutFiles, limits);
}

tl::expected<RecordingReader, std::string> RecordingReader::open(std::unique_ptr<ByteSource> source,
                                                                 std::string name, CutFiles cutFiles,
                                                                 const ReadLimits& limits) {
  auto mcap = McapReader::open(std::move(source), limits.mcap());
  if (!mcap) return tl::unexpected(name + " cannot be read: " + mcap.error());
  RecordingReader reader(std::move(*mcap), std::move(name), limits);
  for (const auto& [id, channel] : reader.mcap_.channels()) {
    const auto known = std::find(kTopicNames.begin(), kTopicNames.end(), channel.topic);
    if (known != kTopicNames.end()) reader.topics_[id] = static_cast<Topic>(known - kTopicNames.begin());
  }
  const Metadata* metadata = reader.mcap_.metadata(std::string(kMetadataName));
  if (metadata == nullptr || reader.topics_.empty())
    return tl::unexpected(reader.name_ +
                          " is an MCAP file, but no recording of clothstream: its metadata is missing");
  reader.metadata_ = *metadata;
  if (cutFiles == CutFiles::refused && !reader.mcap_.indexed())
    return tl::unexpected(reader.name_ + " is truncated or damaged at its end: `clothstream recover " +
                          reader.name_ + " OUT` makes a complete recording of the rest");
  return reader;
}

tl::expected<void, std::string> RecordingReader::check() {
  loaded_.reset();
  if (auto checked = mcap_.check(); !checked) return broken(checked.error());
  return {};
}

const std::string& RecordingReader::metadata(const std::string& name) const {
  static const std::string kUnknown = "unknown";
  const auto found = metadata_.find(name);
  return found == metadata_.end() ? kUnknown : found->second;
}

std::optional<Topic> RecordingReader::topicOf(std::uint16_t channel) const {
  const auto found = topics_.find(channel);
  if (found == topics_.end()) return std::nullopt;
  return found->second;
}

std::uint64_t RecordingReader::start() const {
  return mcap_.chunks().empty() ? 0 : mcap_.chunks().front().start;
}

std::uint64_t RecordingReader::end() const {
  return mcap_.chunks().empty() ? 0 : mcap_.chunks().back().end;
}

tl::expected<void, std::string> RecordingReader::load(std::size_t chunk) {
  if (loaded_ == chunk) return {};
  loaded_.reset();
  const auto messages = mcap_.read(chunk);
  if (!messages) return broken(messages.error());
  messages_ = *messages;
  loaded_ = chunk;
  return {};
}

tl::expected<std::optional<RecordedMessage>, std::string> RecordingReader::next() {
  for (; chunk_ < mcap_.chunks().size(); ++chunk_, message_ = 0) {
    if (auto loaded = load(chunk_); !loaded) return tl::unexpected(loaded.error());
    while (message_ < messages_.size()) {
      const Message& message = messages_[message_++];
      if (const auto topic = topicOf(message.channel))
        return RecordedMessage{*topic, message.time, message.bytes};
    }
  }
  return std::nullopt;
}

tl::expected<std::string, std::string> RecordingReader::description() {
  rewind();
  for (;;) {
    const auto message = next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return broken("the description of its stream is missing");
    if ((*message)->topic != Topic::description) continue;
    rewind();
    return std::string((*message)->bytes);
  }
}

void RecordingReader::rewind() {
  chunk_ = message_ = 0;
}

tl::expected<std::vector<RecordedMessage>, std::string> RecordingReader::messages(std::size_t chunk,
                                                                                  Topic topic,
                                                                                  std::size_t first,
                                                                                  std::size_t end) {
  std::vector<RecordedMessage> found;
  const auto& channels = mcap_.chunks()[chunk].channels;
  const auto isOfTopic = [&](std::uint16_t channel) { return topicOf(channel) == topic; };
  if (channels && std::none_of(channels->begin(), channels->end(), isOfTopic)) return found;
  if (auto loaded = load(chunk); !loaded) return tl::unexpected(loaded.error());
  for (std::size_t i = first; i < std::min(end, messages_.size()); ++i)
    if (isOfTopic(messages_[i].channel)) found.push_back({topic, messages_[i].time, messages_[i].bytes});
  return found;
}

ChunkPlace RecordingReader::passChunk() {
  if (chunk_ >= mcap_.chunks().size()) return {.start = end(), .end = end()};
  message_ = 0;
  return mcap_.chunks()[chunk_++];
}

tl::expected<void, std::string> RecordingReader::seek(std::uint64_t time) {
  rewind();
  if (mcap_.chunks().empty()) return {};
  for (std::size_t chunk = mcap_.chunkAt(time) + 1; chunk-- > 0;) {
    if (auto loaded = load(chunk); !loaded) return loaded;
    for (std::size_t i = messages_.size(); i-- > 0;) {
      const Message& message = messages_[i];
      if (message.time > time || topicOf(message.channel) != Topic::frames || !isKeyFrame(message.bytes))
        continue;
      chunk_ = chunk;
      message_ = i;
      return {};
    }
  }
  return {};
}

}  // namespace clothstream::recording
