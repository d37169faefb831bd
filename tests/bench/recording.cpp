// SPDX-License-Identifier: MIT
// clothstream-bench-recording: what opening a recording of an hour takes, and going to any time in it. Ends
// with 1 where a seek does not lead to the key frame that it should.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_reader.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace {

using namespace clothstream;
using namespace clothstream::recording;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kHour = 3600 * kSampleRate;
constexpr int kSeeks = 2000;

template <typename Value>
Value got(tl::expected<Value, std::string> value) {
  if (!value) throw std::runtime_error(value.error());
  if constexpr (!std::is_void_v<Value>) return std::move(*value);
}

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void checkTick(std::string_view bytes, std::uint64_t wanted) {
  v1::Frame frame;
  const bool parsed = frame.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  const auto packet = codec::parsePacket(std::as_bytes(std::span(frame.packet())));
  if (!parsed || !packet || packet->header.tick != wanted || packet->header.kind != codec::PacketKind::key)
    throw std::runtime_error(fmt::format("a seek did not lead to the key frame of tick {}", wanted));
}

void measure() {
  const e2e::TemporaryDirectory directory;
  const std::string path = (directory.path() / "hour.mcap").string();
  {
    OutputFile file = got(OutputFile::create(path));
    writeSample([&](std::string_view bytes) { return file.write(bytes); }, kHour);
  }
  const auto opening = Clock::now();
  RecordingReader reader = got(RecordingReader::open(path));
  const double openMs = millisecondsSince(opening);
  std::mt19937 random(2);
  std::vector<double> seeks;
  for (int i = 0; i < kSeeks; ++i) {
    const auto frame = static_cast<std::uint32_t>(random() % kHour);
    const auto start = Clock::now();
    got(reader.seek(sampleTime(frame)));
    const auto message = got(reader.next());
    seeks.push_back(millisecondsSince(start));
    if (!message) throw std::runtime_error("a seek led to the end");
    checkTick(message->bytes, frame / kFramesAKeyFrame * kFramesAKeyFrame + 1);
  }
  std::ranges::sort(seeks);
  fmt::print(
      "{} frames, {:.1f} MiB, {} chunks\nopen  {:.2f} ms\nseek  {:.3f} ms median, {:.3f} ms p99, {:.3f} ms "
      "at most\n",
      kHour, static_cast<double>(reader.mcap().bytes()) / (1 << 20), reader.mcap().chunks().size(), openMs,
      seeks[seeks.size() / 2], seeks[seeks.size() * 99 / 100], seeks.back());
}

}  // namespace

int main() {
  try {
    measure();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-bench-recording: %s\n", error.what());
    return 1;
  }
}
