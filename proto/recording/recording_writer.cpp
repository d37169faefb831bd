// SPDX-License-Identifier: MIT
// Writer of recordings: a channel for each topic, with the schema of its messages.
#include "proto/recording/recording_writer.h"

#include <set>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "proto/recording/message_types.h"

namespace clothstream::recording {
namespace {

namespace protobuf = google::protobuf;

// Adds imported files first.
void add(const protobuf::FileDescriptor& file, std::set<std::string>& known,
         protobuf::FileDescriptorSet& files) {
  if (!known.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add(*file.dependency(i), known, files);
  file.CopyTo(files.add_file());
}

Schema schemaOf(const protobuf::Descriptor& type) {
  std::set<std::string> known;
  protobuf::FileDescriptorSet files;
  add(*type.file(), known, files);
  return {type.full_name(), files.SerializeAsString()};
}

}  // namespace

tl::expected<RecordingWriter, std::string> RecordingWriter::begin(Sink sink, std::string_view writer,
                                                                  const Metadata& metadata) {
  RecordingWriter recording(std::move(sink));
  if (Written begun = recording.mcap_.begin(writer); !begun) return tl::unexpected(begun.error());
  for (std::size_t i = 0; i < kTopicNames.size(); ++i) {
    const auto channel = recording.mcap_.addChannel(kTopicNames[i], schemaOf(typeOf(static_cast<Topic>(i))));
    if (!channel) return tl::unexpected(channel.error());
    recording.channels_[i] = *channel;
  }
  if (Written added = recording.mcap_.addMetadata(kMetadataName, metadata); !added)
    return tl::unexpected(added.error());
  return recording;
}

Written RecordingWriter::write(Topic topic, std::uint64_t time, std::string_view message) {
  return mcap_.write(channels_[static_cast<std::size_t>(topic)], time, message);
}

Written RecordingWriter::write(std::uint64_t time, const v1::ServerMessage& message) {
  const auto put = [&](Topic topic, const protobuf::MessageLite& body) {
    body.SerializeToString(&bytes_);
    return write(topic, time, bytes_);
  };
  switch (message.body_case()) {
    case v1::ServerMessage::kFrame:
      return put(Topic::frames, message.frame()).and_then([&]() -> Written {
        if (!message.frame().has_report()) return {};
        return put(Topic::reports, message.frame().report());
      });
    case v1::ServerMessage::kParameterChanged:
      return put(Topic::parameters, message.parameter_changed());
    case v1::ServerMessage::kTickEvents:
      return put(Topic::events, message.tick_events());
    case v1::ServerMessage::kNotice:
      return put(Topic::notices, message.notice());
    default:
      return {};
  }
}

}  // namespace clothstream::recording
