// SPDX-License-Identifier: MIT
// Joining, and every message into the file.
#include "clients/cli/record.h"

#include <chrono>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "clients/cli/complaint.h"
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
// A key frame that is asked for now comes some frames later.
constexpr std::uint32_t kAskAfterFrames = recording::kFramesAKeyFrame - 8;

// Thread-safe: messages come on the stream's thread, chunks are closed by the waiting one.
class StreamFile {
 public:
  StreamFile(recording::OutputFile file, std::string program)
      : file_(std::move(file)), program_(std::move(program)) {}

  void receive(std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    if (!written_ || !message_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    // What comes to somebody else than who began the file is of another stream, perhaps of another server.
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

  // The stream that the file holds is over, though another one comes.
  bool broken() const {
    const std::lock_guard lock(mutex_);
    return broken_;
  }

  bool wantsKeyFrame() const {
    const std::lock_guard lock(mutex_);
    return sinceKey_ >= kAskAfterFrames;
  }

  // What was received a chunk's time ago is with the system when it returns.
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

  // Pieces of one content come in order; the client's core refuses a stream in which they do not.
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
  std::optional<recording::RecordingWriter> writer_;  // from the description on
  v1::ServerMessage message_;
  v1::Welcome welcome_;
  std::string content_;
  std::optional<SteadyClock::time_point> chunkStart_;
  bool broken_ = false;
  std::uint64_t frames_ = 0;
  std::uint32_t sinceKey_ = 0;  // frames
};

// Until the time is over, a signal comes, the stream ends or the file cannot be written.
std::optional<Complaint> follow(GrpcClient& client, StreamFile& file, const RecordOptions& options) {
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
    if (auto written = file.flush(); !written) return Complaint{kNotWritten, written.error()};
    if (file.broken())
      return Complaint{kLost,
                       "The connection was lost for so long, or the server began anew, that the stream "
                       "could not be taken up again: the recording ends there."};
    if (const auto failure = client.ended()) return Complaint{exitCodeOf(failure->kind), failure->text};
    if (terminal)
      fmt::print(stderr, "\r\033[K{:.0f} s, {} frames, {:.1f} MiB", passed.count(), file.frames(),
                 static_cast<double>(file.bytes()) / (1 << 20));
  }
}

}  // namespace

ExitCode record(const RecordOptions& options) {
  auto output = recording::OutputFile::create(options.output);
  if (!output) return say({kNotWritten, output.error()});
  StreamFile file(std::move(*output), options.program);
  GrpcClientOptions clientOptions;
  clientOptions.scene = options.scene;
  clientOptions.clientName = "clothstream record";
  clientOptions.role = CS_ROLE_VIEWER;
  clientOptions.cancelled = [] { return interrupted(); };
  clientOptions.onMessage = [&](std::span<const std::byte> bytes) { file.receive(bytes); };
  const auto onEvents = [&](cs_client* core, std::uint32_t events) {
    if (events == 0 && cs_get_state(core) == CS_STATE_RECONNECTING)
      fmt::print(stderr,
                 "clothstream: the connection is lost; trying to come back. What is streamed meanwhile "
                 "will be missing.\n");
    if ((events & CS_EVENT_RETURNED) != 0 && cs_resumed(core) != 0)
      fmt::print(stderr, "clothstream: back; the recording goes on.\n");
    if ((events & CS_EVENT_FRAME) != 0 && file.wantsKeyFrame())
      cs_request_key_frame(core, GrpcClient::nowUs());
  };
  std::optional<Complaint> problem;
  Report report;
  {
    auto joined = GrpcClient::join(options.address, clientOptions, onEvents);
    if (!joined) {
      std::filesystem::remove(options.output);
      return say({exitCodeOf(joined.error().kind), joined.error().text});
    }
    problem = follow(**joined, file, options);
    (*joined)->visit([&](cs_client* core) { report = Report::of(core, GrpcClient::nowUs()); });
  }
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K");
  if (auto finished = file.finish(); !finished && !problem)
    problem = Complaint{kNotWritten, finished.error()};
  fmt::print("{}: {}, {} frames in {:.1f} s, {:.1f} MiB; {} frames were lost on the way\n", options.output,
             report.scene, file.frames(), report.seconds, static_cast<double>(file.bytes()) / (1 << 20),
             report.statistics.dropped);
  return problem ? say(*problem) : kOk;
}

}  // namespace clothstream::cli
