// SPDX-License-Identifier: MIT
// Reads and writes length-delimited messages after the header.
#include "clients/files/recording.h"

#include <array>
#include <bit>
#include <cstring>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include "clients/files/regular_file.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream::files {
namespace {

namespace protobuf = google::protobuf;

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kName = "clothstream\n";
using Numbers = std::array<std::uint32_t, 2>;  // frames, side

template <typename Message>
tl::expected<void, std::string> append(NewFile& file, const Message& message) {
  std::string bytes;
  {
    protobuf::io::StringOutputStream stream(&bytes);
    protobuf::util::SerializeDelimitedToZeroCopyStream(message, &stream);
  }
  return file.write(bytes);
}

v1::StreamDescription toMessage(const RecordingHead& head) {
  const codec::StreamLayout& layout = head.layout;
  v1::StreamDescription message;
  message.set_epoch(layout.epoch);
  message.set_codec(layout.codec);
  message.set_simulation_rate(head.rate);
  message.set_stream_rate(head.rate);
  message.set_max_error(layout.maxError);
  message.set_normals(layout.normals == codec::NormalMode::octahedral ? v1::NORMALS_OCTAHEDRAL
                                                                      : v1::NORMALS_NONE);
  message.set_qualities(layout.qualities);
  for (const codec::ClothLayout& cloth : layout.cloths) {
    v1::ClothDescription& description = *message.add_cloths();
    description.set_vertex_count(cloth.vertexCount);
    description.set_rows(cloth.rows);
    description.set_columns(cloth.columns);
  }
  return message;
}

// Numbers that are too large for the layout become invalid ones.
codec::StreamLayout toLayout(const v1::StreamDescription& message) {
  const auto small = [](std::uint32_t number) { return static_cast<std::uint8_t>(std::min(number, 255u)); };
  codec::StreamLayout layout{.epoch = message.epoch(),
                             .codec = small(message.codec()),
                             .maxError = message.max_error(),
                             .normals = message.normals() == v1::NORMALS_OCTAHEDRAL
                                            ? codec::NormalMode::octahedral
                                            : codec::NormalMode::none,
                             .qualities = small(std::max(message.qualities(), 1u)),
                             .cloths = {}};
  for (const v1::ClothDescription& cloth : message.cloths())
    layout.cloths.push_back({cloth.vertex_count(), cloth.rows(), cloth.columns(), {}});
  return layout;
}

}  // namespace

tl::expected<RecordingWriter, std::string> RecordingWriter::create(const std::string& path,
                                                                   const RecordingHead& head) {
  auto file = NewFile::create(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  const Numbers numbers{head.frames, static_cast<std::uint32_t>(head.side)};
  auto written = file->write(kName)
                     .and_then([&] { return file->write(std::as_bytes(std::span(numbers))); })
                     .and_then([&] { return files::append(*file, toMessage(head)); });
  if (!written) return tl::unexpected(std::move(written.error()));
  return RecordingWriter(std::move(*file));
}

tl::expected<void, std::string> RecordingWriter::append(std::span<const std::byte> packet,
                                                        std::uint64_t reconstructionHash) {
  v1::Frame frame;
  frame.set_packet(packet.data(), packet.size());
  frame.set_reconstruction_hash(reconstructionHash);
  return files::append(file_, frame);
}

struct RecordingReader::State {
  State(std::string path_, std::ifstream file_) : path(std::move(path_)), file(std::move(file_)) {}

  std::string path;
  std::ifstream file;
  protobuf::io::IstreamInputStream stream{&file};
  RecordingHead head;
  std::uint32_t next = 0;
};

RecordingReader::RecordingReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader::~RecordingReader() = default;

const RecordingHead& RecordingReader::head() const {
  return state_->head;
}

tl::expected<RecordingReader, std::string> RecordingReader::open(const std::string& path) {
  auto file = openRegularFile(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  std::array<char, kName.size()> name{};
  if (!file->stream.read(name.data(), name.size()) || std::string_view(name.data(), name.size()) != kName)
    return tl::unexpected(
        fmt::format("{} is not a file of clothstream encode: its first bytes differ", path));
  const auto broken = [&](const std::string& what) {
    return tl::unexpected(fmt::format("{} is broken: {}", path, what));
  };
  Numbers numbers{};
  if (!file->stream.read(reinterpret_cast<char*>(numbers.data()), sizeof numbers))
    return broken("it ends in its header");
  const auto [frames, side] = numbers;
  auto state = std::make_unique<State>(path, std::move(file->stream));
  v1::StreamDescription description;
  if (!protobuf::util::ParseDelimitedFromZeroCopyStream(&description, &state->stream, nullptr))
    return broken("it has no description of its stream");
  state->head = {toLayout(description), description.stream_rate(), frames, static_cast<Side>(side)};
  if (!codec::isCodec(state->head.layout.codec))
    return tl::unexpected(fmt::format("{} has the unknown codec {}; this version decodes codec {}", path,
                                      state->head.layout.codec, codec::kCodecHierarchical));
  if (!codec::isPossible(state->head.layout) || frames == 0 || frames > INT32_MAX || side > 1)
    return broken("its description of the stream is not valid");
  return RecordingReader(std::move(state));
}

tl::expected<RecordedPacket, std::string> RecordingReader::next() {
  State& s = *state_;
  const auto broken = [&](const std::string& what) {
    return tl::unexpected(fmt::format("{} is broken: {}", s.path, what));
  };
  v1::Frame frame;
  bool atEnd = false;
  if (!protobuf::util::ParseDelimitedFromZeroCopyStream(&frame, &s.stream, &atEnd))
    return broken(atEnd ? fmt::format("it ends after {} of {} frames", s.next, s.head.frames)
                        : fmt::format("frame {} (of 0 to {}) cannot be read", s.next, s.head.frames - 1));
  if (++s.next == s.head.frames) {
    const void* more = nullptr;
    int size = 0;
    while (s.stream.Next(&more, &size))
      if (size > 0) return broken(fmt::format("there are bytes after its {} frames", s.head.frames));
  }
  return RecordedPacket{std::move(*frame.mutable_packet()), frame.reconstruction_hash()};
}

}  // namespace clothstream::files
