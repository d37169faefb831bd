// SPDX-License-Identifier: MIT
#include "tests/recording/sample.h"

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

void must(const Written& written) {
  if (!written) throw std::runtime_error(written.error());
}

}  // namespace

const codec::StreamLayout& sampleLayout() {
  return kLayout;
}

v1::StreamDescription sampleDescription(std::uint8_t layers) {
  v1::StreamDescription description;
  description.set_epoch(kLayout.epoch);
  description.set_codec(kLayout.codec);
  description.set_scene("sample");
  description.set_simulation_rate(kSampleRate);
  description.set_stream_rate(kSampleRate);
  description.set_max_error(kLayout.maxError);
  description.set_temporal_layers(layers);
  v1::ClothDescription& cloth = *description.add_cloths();
  cloth.set_name("sheet");
  cloth.set_vertex_count(42);
  cloth.set_rows(6);
  cloth.set_columns(7);
  const std::vector<float> rest = codec::sampleMotion(kLayout, 0, 0).positions;
  cloth.set_rest_positions(rest.data(), rest.size() * sizeof(float));
  return description;
}

void writeSample(const Sink& sink, std::uint32_t frames, std::uint8_t layers) {
  auto writer = RecordingWriter::begin(sink, "sample", {{"scene", "sample"}, {"device", "none"}});
  if (!writer) throw std::runtime_error(writer.error());
  must(writer->write(Topic::description, sampleTime(0), sampleDescription(layers).SerializeAsString()));
  codec::StreamLayout layout = kLayout;
  layout.temporalLayers = layers;
  const auto encoder = codec::Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  v1::ServerMessage message;
  v1::RecordedTick tick;
  for (std::uint32_t i = 0; i < frames; ++i) {
    const bool key = i % kFramesAKeyFrame == 0;
    const codec::MotionFrame motion = codec::sampleMotion(kLayout, i % 600, 0.05f);
    const std::size_t bytes = encoder->encode(
        i + 1, key ? codec::PacketKind::key : codec::PacketKind::predicted, motion.positions, {}, packet);
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

std::string sampleRecording(std::uint32_t frames, std::uint8_t layers) {
  std::string bytes;
  writeSample(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      frames, layers);
  return bytes;
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
