// SPDX-License-Identifier: MIT
// clothstream-bench-recording: time to open a recording for playback, and to seek in it until the viewer has
// the key frame and its parameters. Also for recordings with constant parameter changes, and for truncated
// files. The exit status is 1 if a seek leads to a wrong place, and 2 for wrong arguments.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <memory>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/playback.h"
#include "server/recording/recorded_stream.h"
#include "server/scene/live_scene.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace {

using namespace clothstream;
using namespace clothstream::recording;
using Clock = std::chrono::steady_clock;

struct Options {
  std::uint32_t minutes = 60;  // length of each recording
  std::uint32_t seeks = 2000;  // in each recording
};

template <typename Value>
Value got(tl::expected<Value, std::string> value) {
  if (!value) throw std::runtime_error(value.error());
  if constexpr (!std::is_void_v<Value>) return std::move(*value);
}

// Processor time of this thread in ms: the cost of a seek without other work.
double processorMs() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A viewer that acknowledges each frame at once.
class Viewer {
 public:
  explicit Viewer(scene::LiveScene& scene) : scene_(scene) {
    scene.subscribers.add(mailbox_);
    mailbox_->subscribe(scene.description(), scene.shape(), scene.metrics);
  }
  ~Viewer() { scene_.subscribers.remove(*mailbox_); }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // Reads all waiting messages. Returns true if a frame was among them.
  bool read(Clock::time_point now) {
    bool framed = false;
    while (const auto bytes = mailbox_->next(now)) {
      if (!message_.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())))
        throw std::runtime_error("a message cannot be parsed");
      if (message_.has_parameter_changed()) parameters.Swap(message_.mutable_parameter_changed());
      if (!message_.has_frame()) continue;
      const auto packet = codec::parsePacket(std::as_bytes(std::span(message_.frame().packet())));
      framed = packet && packet->header.kind == codec::PacketKind::key &&
               mailbox_->acknowledge(packet->header.tick, now);
    }
    return framed;
  }

  v1::ParameterChanged parameters;  // last received parameters

 private:
  scene::LiveScene& scene_;
  std::shared_ptr<delivery::Mailbox> mailbox_ = std::make_shared<delivery::Mailbox>([] {});
  v1::ServerMessage message_;
};

// Checks that the viewer has the last parameters and stands at the right frame.
void check(std::uint32_t frame, const v1::Playback& playback, const v1::ParameterChange& sent, bool sliders) {
  const std::uint32_t key = frame / kMaxKeyFrameDistance * kMaxKeyFrameDistance;
  if (std::abs(playback.position() * kSampleRate - key) > 0.01)
    throw std::runtime_error(fmt::format("a seek to frame {} led to {} s", frame, playback.position()));
  if (!sliders) return;
  const SampleSliders wanted = sampleSliders(key);
  if (sent.wind().value().x() != wanted.wind || sent.cloths_size() != 1 ||
      sent.cloths(0).structural().stiffness() != wanted.stiffness)
    throw std::runtime_error(
        fmt::format("a seek to frame {} sent wrong parameters: {}", frame, sent.ShortDebugString()));
}

// Measures `seekCount` seeks in a recording of `frames` frames that is played to one viewer.
void measure(const std::string& name, const std::string& path, std::uint32_t frames, bool sliders,
             std::uint32_t seekCount) {
  const auto opening = Clock::now();
  RecordedStream recording = got(RecordedStream::open(path));
  const double openMs = millisecondsSince(opening);
  const auto playback = std::make_shared<Playback>(std::move(recording), PlaybackOptions{});
  scene::LiveScene scene("sample", playback);
  Viewer viewer(scene);
  playback->step(scene, Clock::now());
  viewer.read(Clock::now());
  std::mt19937 random(2);
  std::vector<double> seeks;
  double mostProcessorMs = 0;
  for (std::uint32_t i = 0; i < seekCount; ++i) {
    const auto frame = static_cast<std::uint32_t>(random() % frames);
    v1::ControlSceneRequest request;
    // Never before the frame, whatever the rounding.
    request.set_seek((frame + 1e-3) / kSampleRate);
    viewer.parameters.Clear();
    const double processorStart = processorMs();
    const auto start = Clock::now();
    if (!playback->control(request)) throw std::runtime_error("a seek was refused");
    playback->step(scene, start);
    const bool framed = viewer.read(Clock::now());
    seeks.push_back(millisecondsSince(start));
    mostProcessorMs = std::max(mostProcessorMs, processorMs() - processorStart);
    if (!framed) throw std::runtime_error("a seek sent no key frame");
    check(frame, *playback->playback(), viewer.parameters.change(), sliders);
  }
  std::ranges::sort(seeks);
  fmt::print("{:<32}{:>8.1f}{:>10.1f}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}\n", name,
             static_cast<double>(std::filesystem::file_size(path)) / (1 << 20), openMs,
             seeks[seeks.size() / 2], seeks[seeks.size() * 99 / 100], seeks.back(), mostProcessorMs);
}

// Truncates the file like a killed program: no index, and an incomplete last chunk.
std::uint32_t cut(const std::string& path) {
  RecordingReader reader = got(RecordingReader::open(path));
  const ChunkPlace last = reader.mcap().chunks().back();
  std::filesystem::resize_file(path, last.offset + last.length / 2);
  // Number of frames before it; times are rounded to ns.
  return static_cast<std::uint32_t>(
      std::llround(1e-9 * static_cast<double>(last.start - kSampleStart) * kSampleRate));
}

void measure(const Options& options) {
  const std::uint32_t frames = 60 * options.minutes * kSampleRate;
  fmt::print("{:<32}{:>8}{:>10}{:>10}{:>10}{:>10}{:>10}\n",
             fmt::format("{} min; {} seeks each, ms", options.minutes, options.seeks), "MiB", "open",
             "median", "p99", "most", "processor");
  const e2e::TemporaryDirectory directory;
  const auto measureOne = [&](const std::string& name, bool sliders, const auto& write) {
    const std::string path = (directory.path() / "bench.mcap").string();
    {
      OutputFile file = got(OutputFile::create(path));
      write([&](std::string_view bytes) { return file.write(bytes); });
    }
    measure(name, path, frames, sliders, options.seeks);
    measure(name + ", cut", path, cut(path), sliders, options.seeks);
    std::filesystem::remove(path);
  };
  measureOne("42 vertices", false, [&](const Sink& sink) { writeSample(sink, frames); });
  measureOne("42 vertices, sliders", true, [&](const Sink& sink) { writeSampleWithSliders(sink, frames); });
  codec::StreamLayout large = sampleLayout();
  large.cloths = {{.vertexCount = 4096, .rows = 64, .columns = 64}};
  measureOne("4,096 vertices, sliders", true,
             [&](const Sink& sink) { writeSampleWithSliders(sink, frames, large); });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Measures the time to open recordings for playback and to seek in them. Checks where each seek leads.",
      "clothstream-bench-recording"};
  app.footer(
      "Exit status: 0 if every seek led to the right place, 1 otherwise or for an error, 2 for wrong "
      "arguments.");
  Options options;
  app.add_option("--minutes", options.minutes, "Length of each recording")
      ->check(CLI::Range(1, 600))
      ->capture_default_str();
  app.add_option("--seeks", options.seeks, "Seeks in each recording")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    measure(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-bench-recording: %s\n", error.what());
    return 1;
  }
}
