// SPDX-License-Identifier: MIT
// Suite codec_device: cost of the device's part of a frame, for a curtain with a sphere that swings through
// it.
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "proto/codec/decoder.h"
#include "server/encode/frame_encoder.h"
#include "server/model/stability.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// First measured tick. The motion starts from rest.
constexpr std::uint64_t kFirstTick = 72;
constexpr std::uint64_t kTicks = 4 * 72;

// Adds nothing if the device takes no time stamps.
void addTimes(nlohmann::ordered_json& row, const std::string& what, const Samples& seconds) {
  if (seconds.count() == 0) return;
  row[what + "MsMin"] = seconds.min() * 1e3;
  row[what + "MsMedian"] = seconds.median() * 1e3;
  row[what + "MsP99"] = seconds.p99() * 1e3;
}

nlohmann::ordered_json measure(vulkan::Device& device, const model::Scene& scene, codec::PacketKind kind,
                               encode::Prediction prediction) {
  simulation::ClothSimulation simulation(device, scene);
  const codec::StreamLayout layout = encode::streamLayout(scene, 1);
  encode::FrameEncoder encoder(device, simulation, layout, prediction);
  const auto decoder = codec::Decoder::make(layout);
  vulkan::Recorder recorder(device);
  std::vector<std::byte> packet(encoder.packetBound());
  Samples bytes, deviceTime, entropyTime, decodeTime;
  double sum = 0;
  for (std::uint64_t tick = 1; tick <= kFirstTick + kTicks; ++tick) {
    encode::RecordedFrame frame;
    runOn(device, recorder, [&] {
      simulation.recordTick(recorder, hungClothInputs(scene, tick));
      if (layout.normals != codec::NormalMode::none) simulation.recordNormals(recorder);
      frame = encoder.record(recorder, tick, kind == codec::PacketKind::key);
    });
    if (!simulation.status().healthy)
      throw std::runtime_error(fmt::format("the state after tick {} is not healthy", tick));
    encode::EncodedFrame encoded;
    const double entropySeconds = secondsOf([&] { encoded = encoder.entropyCode(frame, packet); });
    codec::DecodeResult result{};
    const double decodeSeconds =
        secondsOf([&] { result = decoder->decode(std::span(packet).first(encoded.bytes)); });
    if (result != codec::DecodeResult::ok || decoder->reconstructionHash() != encoded.reconstructionHash)
      throw std::runtime_error(fmt::format("the frame of tick {} decodes to a different state", tick));
    if (tick <= kFirstTick) continue;
    sum += static_cast<double>(encoded.bytes);
    bytes.add(static_cast<double>(encoded.bytes));
    entropyTime.add(entropySeconds);
    decodeTime.add(decodeSeconds);
    for (const vulkan::StageTime& stage : recorder.stageTimes()) {
      if (stage.stage == std::string_view("encode")) deviceTime.add(stage.seconds);
    }
  }
  const double vertices = scene.nodeCount();
  nlohmann::ordered_json row{
      {"suite", "codec_device"},
      {"nodes", scene.nodeCount()},
      {"kind", kind == codec::PacketKind::key ? "key" : "predicted"},
      {"prediction", prediction == encode::Prediction::onHost ? "host" : "device"},
      {"normals", layout.normals == codec::NormalMode::none ? "none" : "octahedral"},
      {"maxErrorMm", layout.maxError * 1e3},
      {"bitsPerVertex", 8 * sum / static_cast<double>(kTicks) / vertices},
      {"bitsPerVertexP99", 8 * bytes.p99() / vertices},
      {"kbitPerSecond", 8 * sum / static_cast<double>(kTicks) * scene.streamRate / 1000}};
  addTimes(row, "quantiseAndPredict", deviceTime);
  addTimes(row, "entropy", entropyTime);
  addTimes(row, "decode", decodeTime);
  row["frames"] = kTicks;
  return row;
}

}  // namespace

void runCodecDevice(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::pair<model::Normals, encode::Prediction> ways[]{
      {model::Normals::none, encode::Prediction::onHost},
      {model::Normals::none, encode::Prediction::onDevice},
      {model::Normals::octahedral, encode::Prediction::onHost},
      {model::Normals::octahedral, encode::Prediction::onDevice}};
  for (const auto& [normals, prediction] : ways) {
    for (const codec::PacketKind kind : {codec::PacketKind::predicted, codec::PacketKind::key}) {
      model::Scene scene = hungCloth(settings.size.value_or(100));
      scene.substeps = std::max(scene.substeps, model::stableSubsteps(scene));
      scene.stream.normals = normals;
      Row row = measure(device, scene, kind, prediction);
      row["device"] = device.info().name;
      add(row);
    }
  }
}

}  // namespace clothstream::bench
