// SPDX-License-Identifier: MIT
// Joins and writes every message to the file.
#include "clients/cli/record.h"

#include <chrono>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "clients/cli/error.h"
#include "clients/cli/report.h"
#include "clients/cli/signals.h"
#include "clients/grpc/grpc_client.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/clock.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_writer.h"

namespace clothstream::cli {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kInterval{50};
// Requests a key frame early, since it arrives some frames later.
constexpr std::uint32_t kAskAfterFrames = recording::kMaxKeyFrameDistance - 8;

// Thread-safe: the stream's thread adds messages, the waiting thread closes chunks.
class StreamFile {
 public:
  StreamFile(recording::OutputFile file, std::string program)
      : file_(std::move(file)), program_(std::move(program)) {}

  void receive(std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    if (!written_ || !message_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    // A Welcome that does not resume starts another stream, perhaps of another server.
    if (message_.has_welcome() && writer_ && !message_.welcome().resumed()) broken_ = true;
    if (broken_) return;
    if (message_.has_welcome()) welcome_ = message_.welcome();
    if (message_.has_chunk()) return take(message_.chunk());
    if (!writer_) return;
    if (!chunkStart_) chunkStart_ = SteadyClock::now();
    written_ = writer_->write(clock_.now(), message_);
    if (!message_.has_frame()) return;
    ++frames_;
    sinceKey_ = isKey(message_.frame()) ? 0 : sinceKey_ + 1;
  }

  // Whether the recorded stream is over because another one has started.
  bool broken() const {
    const std::lock_guard lock(mutex_);
    return broken_;
  }

  bool wantsKeyFrame() const {
    const std::lock_guard lock(mutex_);
    return sinceKey_ >= kAskAfterFrames;
  }

  // Closes the chunk when its time is over, so that its messages reach the operating system.
  recording::Written flush() {
    const std::lock_guard lock(mutex_);
    if (written_ && writer_ && chunkStart_ &&
        SteadyClock::now() - *chunkStart_ >= std::chrono::nanoseconds(recording::McapWriter::kChunkNs)) {
      written_ = writer_->closeChunk();
      chunkStart_.reset();
    }
    return written_;
  }

  recording::Written finish() {
    const std::lock_guard lock(mutex_);
    if (written_ && writer_) written_ = writer_->finish().and_then([&] { return file_.sync(); });
    return written_;
  }

  std::uint64_t frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  std::uint64_t bytes() const {
    const std::lock_guard lock(mutex_);
    return writer_ ? writer_->bytes() : 0;
  }

 private:
  static bool isKey(const v1::Frame& frame) {
    const auto packet = codec::parsePacket(std::as_bytes(std::span(frame.packet())));
    return packet && packet->header.kind == codec::PacketKind::key;
  }

  // Chunks of one content are in order; the client core refuses other streams.
  void take(const v1::Chunk& chunk) {
    if (chunk.content_id() != welcome_.description_content_id() && writer_ == std::nullopt) return;
    if (chunk.index() == 0) content_.clear();
    content_ += chunk.data();
    if (chunk.index() + 1 != chunk.count()) return;
    v1::StreamDescription description;
    if (!description.ParseFromString(content_)) return;
    if (!writer_) begin(description);
    if (written_) written_ = writer_->write(recording::Topic::description, clock_.now(), content_);
    sinceKey_ = 0;
  }

  void begin(const v1::StreamDescription& description) {
    std::uint64_t vertices = 0;
    for (const v1::ClothDescription& cloth : description.cloths()) vertices += cloth.vertex_count();
    auto writer = recording::RecordingWriter::begin(
        [this](std::string_view bytes) { return file_.write(bytes); }, program_,
        {{"server", welcome_.server_name()},
         {"scene", description.scene()},
         {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
         {"device", welcome_.device_name()},
         {"codec", fmt::format("{}", description.codec())},
         {"max_error", fmt::format("{}", description.max_error())},
         {"vertices", fmt::format("{}", vertices)},
         {"simulation_rate", fmt::format("{}", description.simulation_rate())},
         {"stream_rate", fmt::format("{}", description.stream_rate())}});
    if (writer)
      writer_.emplace(std::move(*writer));
    else
      written_ = tl::unexpected(writer.error());
  }

  mutable std::mutex mutex_;
  recording::OutputFile file_;
  const std::string program_;
  const recording::RecordingClock clock_;
  recording::Written written_;
  std::optional<recording::RecordingWriter> writer_;  // set after the description
  v1::ServerMessage message_;
  v1::Welcome welcome_;
  std::string content_;
  std::optional<SteadyClock::time_point> chunkStart_;
  bool broken_ = false;
  std::uint64_t frames_ = 0;
  std::uint32_t sinceKey_ = 0;  // frames since the last key frame
};

// Waits for the end of the time, a signal, the end of the stream or a write error.
std::optional<Error> follow(NativeClient& client, StreamFile& file, const RecordOptions& options) {
  const auto start = SteadyClock::now();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  for (;;) {
    auto wait = kInterval;
    const std::chrono::duration<double> passed = SteadyClock::now() - start;
    if (options.seconds) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(
          std::chrono::duration<double>(*options.seconds) - passed);
      if (left.count() <= 0) return std::nullopt;
      wait = std::min(wait, left);
    }
    if (interrupted(wait)) return std::nullopt;
    if (auto written = file.flush(); !written) return Error{kNotWritten, written.error()};
    if (file.broken())
      return Error{
          kLost,
          "the stream could not be resumed, because the connection was lost for too long or the server "
          "was restarted; the recording ends there"};
    if (const auto failure = client.ended()) return Error{exitCodeOf(failure->kind), failure->text};
    if (terminal)
      fmt::print(stderr, "\r\033[K{:.0f} s, {} frames, {:.1f} MiB", passed.count(), file.frames(),
                 static_cast<double>(file.bytes()) / (1 << 20));
  }
}

}  // namespace

ExitCode record(const RecordOptions& options) {
  auto output = recording::OutputFile::create(options.output);
  if (!output) return printError(Error{kNotWritten, output.error()});
  StreamFile file(std::move(*output), options.program);
  NativeClientOptions clientOptions;
  clientOptions.scene = options.scene;
  clientOptions.clientName = "clothstream record";
  clientOptions.role = CS_ROLE_VIEWER;
  clientOptions.maxVertices = options.maxVertices;
  clientOptions.cancelled = [] { return interrupted(); };
  clientOptions.onMessage = [&](std::span<const std::byte> bytes) { file.receive(bytes); };
  const auto onEvents = [&](cs_client* core, std::uint32_t events) {
    if (events == 0 && cs_get_state(core) == CS_STATE_RECONNECTING)
      fmt::print(stderr,
                 "clothstream: the connection is lost; reconnecting. Frames of this time will be missing.\n");
    if ((events & CS_EVENT_RETURNED) != 0 && cs_resumed(core) != 0)
      fmt::print(stderr, "clothstream: reconnected; the recording continues.\n");
    if ((events & CS_EVENT_FRAME) != 0 && file.wantsKeyFrame())
      cs_request_key_frame(core, NativeClient::nowUs());
  };
  std::optional<Error> problem;
  Report report;
  {
    auto joined = joinByGrpc(options.address, clientOptions, onEvents);
    if (!joined) {
      std::filesystem::remove(options.output);
      return printError(joined.error());
    }
    problem = follow(**joined, file, options);
    (*joined)->visit([&](cs_client* core) { report = Report::of(core, NativeClient::nowUs()); });
  }
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K");
  if (auto finished = file.finish(); !finished && !problem) problem = Error{kNotWritten, finished.error()};
  fmt::print("{}: {}, {} frames in {:.1f} s, {:.1f} MiB; {} frames were lost\n", options.output,
             printable(report.scene), file.frames(), report.seconds,
             static_cast<double>(file.bytes()) / (1 << 20), report.statistics.dropped);
  return problem ? printError(*problem) : kOk;
}

}  // namespace clothstream::cli
