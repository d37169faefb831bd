// SPDX-License-Identifier: MIT
// Writer of recordings: a channel for each topic, with the schema of its messages.
#include "proto/recording/recording_writer.h"

#include <set>
#include <string>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "proto/recording/message_types.h"

namespace clothstream::recording {
namespace {

namespace protobuf = google::protobuf;

// The messages and enums that messages of a type can contain, by full name. Types inside of others are with
// these.
class Contents {
 public:
  explicit Contents(const protobuf::Descriptor& type) { take(type); }

  bool has(const std::string& name) const { return names_.contains(name); }

 private:
  void take(const protobuf::Descriptor& type) {
    if (const protobuf::Descriptor* outer = type.containing_type()) return take(*outer);
    if (names_.insert(type.full_name()).second) takeFields(type);
  }
  void take(const protobuf::EnumDescriptor& type) {
    if (const protobuf::Descriptor* outer = type.containing_type()) return take(*outer);
    names_.insert(type.full_name());
  }
  void takeFields(const protobuf::Descriptor& type) {
    for (int i = 0; i < type.field_count(); ++i) {
      if (const protobuf::Descriptor* message = type.field(i)->message_type()) take(*message);
      if (const protobuf::EnumDescriptor* choice = type.field(i)->enum_type()) take(*choice);
    }
    for (int i = 0; i < type.nested_type_count(); ++i) takeFields(*type.nested_type(i));
  }

  std::set<std::string> names_;
};

template <typename Types>
void keepOnly(const Contents& contents, const std::string& package, Types& types) {
  for (int i = types.size(); i-- > 0;)
    if (!contents.has(package + '.' + types.Get(i).name())) types.DeleteSubrange(i, 1);
}

// Files of a schema, imported ones first. A file without any of the contents is left out, and so are other
// types.
class Files {
 public:
  Files(const protobuf::FileDescriptor& file, const Contents& contents) : contents_(contents) { add(file); }

  std::string serialised() const { return files_.SerializeAsString(); }

 private:
  void add(const protobuf::FileDescriptor& file) {
    if (!seen_.insert(file.name()).second) return;
    protobuf::FileDescriptorProto reduced;
    file.CopyTo(&reduced);
    reduced.clear_service();
    reduced.clear_dependency();
    reduced.clear_public_dependency();
    reduced.clear_weak_dependency();
    for (int i = 0; i < file.dependency_count(); ++i) {
      add(*file.dependency(i));
      if (kept_.contains(file.dependency(i)->name())) reduced.add_dependency(file.dependency(i)->name());
    }
    keepOnly(contents_, file.package(), *reduced.mutable_message_type());
    keepOnly(contents_, file.package(), *reduced.mutable_enum_type());
    if (reduced.message_type().empty() && reduced.enum_type().empty()) return;
    kept_.insert(file.name());
    *files_.add_file() = std::move(reduced);
  }

  const Contents& contents_;
  std::set<std::string> seen_, kept_;
  protobuf::FileDescriptorSet files_;
};

Schema schemaOf(const protobuf::Descriptor& type) {
  const Contents contents(type);
  return {type.full_name(), Files(*type.file(), contents).serialised()};
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
