// SPDX-License-Identifier: MIT
#include "tests/recording/sample.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clothstream/v1/recording.pb.h"
#include "proto/codec/encoder.h"
#include "proto/recording/recording_writer.h"
#include "tests/codec/motion.h"

namespace clothstream::recording {
namespace {

const codec::StreamLayout kLayout{.epoch = 1,
                                  .codec = codec::kCodecHierarchical,
                                  .maxError = 0.0005f,
                                  .normals = codec::NormalMode::none,
                                  .cloths = {{.vertexCount = 42, .rows = 6, .columns = 7}}};

constexpr float kStiffness = 20;  // stiffness at the start

void must(const Written& written) {
  if (!written) throw std::runtime_error(written.error());
}

v1::StreamDescription descriptionOf(const codec::StreamLayout& layout) {
  v1::StreamDescription description;
  description.set_epoch(layout.epoch);
  description.set_codec(layout.codec);
  description.set_scene("sample");
  description.set_simulation_rate(kSampleRate);
  description.set_stream_rate(kSampleRate);
  description.set_max_error(layout.maxError);
  v1::ClothDescription& cloth = *description.add_cloths();
  cloth.set_name("sheet");
  cloth.set_vertex_count(layout.cloths[0].vertexCount);
  cloth.set_rows(layout.cloths[0].rows);
  cloth.set_columns(layout.cloths[0].columns);
  const std::vector<float> rest = codec::sampleMotion(layout, 0, 0).positions;
  cloth.set_rest_positions(rest.data(), rest.size() * sizeof(float));
  return description;
}

v1::ParameterChanged sliderMoved(std::uint32_t frame) {
  v1::ParameterChanged changed;
  changed.set_tick(frame + 1);
  const auto value = static_cast<float>(frame);
  if (frame / kFramesAChange % 2 == 0) {
    changed.mutable_change()->mutable_wind()->mutable_value()->set_x(value);
  } else {
    v1::ClothChange& cloth = *changed.mutable_change()->add_cloths();
    cloth.set_name("sheet");
    cloth.mutable_structural()->set_stiffness(value);
  }
  return changed;
}

void write(const Sink& sink, std::uint32_t frames, const codec::StreamLayout& layout,
           const v1::StreamDescription& description, bool sliders) {
  auto writer = RecordingWriter::begin(sink, "sample", {{"scene", "sample"}, {"device", "none"}});
  if (!writer) throw std::runtime_error(writer.error());
  must(writer->write(Topic::description, sampleTime(0), description.SerializeAsString()));
  const auto encoder = codec::Encoder::make(layout);
  std::vector<codec::MotionFrame> motion;  // repeated after its last frame
  for (std::uint32_t i = 0; i < std::min(frames, 600u); ++i)
    motion.push_back(codec::sampleMotion(layout, i, 0.05f));
  std::vector<std::byte> packet(encoder->packetBound());
  v1::ServerMessage message;
  v1::RecordedTick tick;
  for (std::uint32_t i = 0; i < frames; ++i) {
    if (sliders && i > 0 && i % kFramesAChange == 0)
      must(writer->write(Topic::parameters, sampleTime(i), sliderMoved(i).SerializeAsString()));
    const bool key = i % kMaxKeyFrameDistance == 0;
    const std::size_t bytes =
        encoder->encode(i + 1, key ? codec::PacketKind::key : codec::PacketKind::predicted,
                        motion[i % motion.size()].positions, {}, packet);
    v1::Frame& frame = *message.mutable_frame();
    frame.set_packet(packet.data(), bytes);
    frame.set_reconstruction_hash(encoder->reconstructionHash());
    must(writer->write(sampleTime(i), message));
    tick.set_tick(i + 1);
    tick.set_state_hash(encoder->reconstructionHash());
    must(writer->write(Topic::ticks, sampleTime(i), tick.SerializeAsString()));
  }
  must(writer->finish());
}

}  // namespace

const codec::StreamLayout& sampleLayout() {
  return kLayout;
}

v1::StreamDescription sampleDescription() {
  return descriptionOf(kLayout);
}

void writeSample(const Sink& sink, std::uint32_t frames) {
  write(sink, frames, kLayout, sampleDescription(), false);
}

void writeSampleWithSliders(const Sink& sink, std::uint32_t frames, const codec::StreamLayout& layout) {
  v1::StreamDescription description = descriptionOf(layout);
  v1::Cloth& cloth = *description.mutable_definition()->add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_structural()->set_stiffness(kStiffness);
  write(sink, frames, layout, description, true);
}

SampleSliders sampleSliders(std::uint32_t frame) {
  const std::uint32_t last = frame / kFramesAChange, wind = last / 2 * 2;
  const std::uint32_t stiffness = last == 0 ? 0 : (last - 1) / 2 * 2 + 1;
  return {.wind = static_cast<float>(wind * kFramesAChange),
          .stiffness = stiffness == 0 ? kStiffness : static_cast<float>(stiffness * kFramesAChange)};
}

std::string sampleRecording(std::uint32_t frames) {
  std::string bytes;
  writeSample(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      frames);
  return bytes;
}

std::string withMessages(const std::string& recording, Topic topic,
                         const std::function<void(std::size_t, std::string&)>& change) {
  RecordingReader reader = readerOf(recording);
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "sample", reader.metadata());
  if (!writer) throw std::runtime_error(writer.error());
  std::size_t count = 0;
  for (auto message = reader.next(); message && *message; message = reader.next()) {
    std::string content((*message)->bytes);
    if ((*message)->topic == topic) change(count++, content);
    must(writer->write((*message)->topic, (*message)->time, content));
  }
  must(writer->finish());
  return bytes;
}

std::string withFrames(const std::string& recording,
                       const std::function<void(std::size_t, v1::Frame&)>& change) {
  return withMessages(recording, Topic::frames, [&](std::size_t number, std::string& bytes) {
    v1::Frame frame;
    if (!frame.ParseFromString(bytes)) throw std::runtime_error("a frame cannot be read");
    change(number, frame);
    bytes = frame.SerializeAsString();
  });
}

std::string withGarbage(const std::string& recording) {
  return withFrames(recording, [](std::size_t, v1::Frame& frame) { frame.set_packet("garbage"); });
}

std::string withCoarseFrames(const std::string& recording, std::uint32_t first) {
  codec::StreamLayout layout = kLayout;
  layout.qualities = 2;
  const std::string described =
      withMessages(recording, Topic::description, [&](std::size_t, std::string& bytes) {
        v1::StreamDescription description = sampleDescription();
        description.set_qualities(layout.qualities);
        bytes = description.SerializeAsString();
      });
  const auto encoder = codec::Encoder::make(layout, {.quality = 1});
  std::vector<std::byte> packet(encoder->packetBound());
  return withFrames(described, [&](std::size_t number, v1::Frame& frame) {
    if (number < first) return;
    const auto i = static_cast<std::uint32_t>(number);
    const bool key = i % kMaxKeyFrameDistance == 0;
    const std::size_t bytes =
        encoder->encode(i + 1, key ? codec::PacketKind::key : codec::PacketKind::predicted,
                        codec::sampleMotion(layout, i, 0.05f).positions, {}, packet);
    frame.set_packet(packet.data(), bytes);
    frame.set_reconstruction_hash(encoder->reconstructionHash());
  });
}

RecordingReader readerOf(std::string bytes, CutFiles cutFiles) {
  auto reader = RecordingReader::open(std::make_unique<MemorySource>(std::move(bytes)), "sample", cutFiles);
  if (!reader) throw std::runtime_error(reader.error());
  return std::move(*reader);
}

std::size_t countMessages(RecordingReader& reader, Topic topic) {
  std::size_t count = 0;
  for (;;) {
    const auto message = reader.next();
    if (!message || !*message) return count;
    if ((*message)->topic == topic) ++count;
  }
}

}  // namespace clothstream::recording
