// SPDX-License-Identifier: MIT
// Joins and writes every message to the file.
#include "clients/cli/record.h"

#include <array>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "clients/cli/error.h"
#include "clients/cli/print.h"
#include "clients/cli/report.h"
#include "clients/cli/signals.h"
#include "clients/cli/stream_time.h"
#include "clients/grpc/grpc_client.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/clock.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_writer.h"
#include "proto/recording/topics.h"

namespace clothstream::cli {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kInterval{50};
// Requests a key frame early, since it arrives some frames later.
constexpr std::uint32_t kAskAfterFrames = recording::kMaxKeyFrameDistance - 8;

// Thread-safe: the stream's thread adds messages, the waiting thread closes chunks.
class StreamFile {
 public:
  // `fullQuality`: ends before the first frame that is coarser than quality 0.
  StreamFile(recording::OutputFile file, std::string program, bool fullQuality)
      : file_(std::move(file)), program_(std::move(program)), fullQuality_(fullQuality) {}

  void receive(std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    if (!written_ || !message_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    // A Welcome that does not resume starts another stream, perhaps of another server.
    if (message_.has_welcome() && writer_ && !message_.welcome().resumed()) broken_ = true;
    if (broken_) return;
    if (message_.has_welcome()) welcome_ = message_.welcome();
    if (message_.has_chunk()) return take(message_.chunk());
    if (!writer_) return;
    // A message without a frame has no bytes here, which parsePacket() refuses.
    const auto packet = codec::parsePacket(std::as_bytes(std::span(message_.frame().packet())));
    if (fullQuality_ && packet && packet->header.quality > 0) coarse_ = true;
    if (coarse_) return;
    if (!chunkStart_) chunkStart_ = SteadyClock::now();
    written_ = writer_->write(clock_.now(), message_);
    if (!message_.has_frame()) return;
    ++frames_;
    if (packet && packet->header.quality < qualities_.size()) ++qualities_[packet->header.quality];
    const bool isKey = packet && packet->header.kind == codec::PacketKind::key;
    sinceKey_ = isKey ? 0 : sinceKey_ + 1;
  }

  // Whether the recorded stream is over because another one has started.
  bool broken() const {
    const std::lock_guard lock(mutex_);
    return broken_;
  }

  // Whether the recorded stream is over because a frame is coarser than the quality that it must have.
  bool coarse() const {
    const std::lock_guard lock(mutex_);
    return coarse_;
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
    if (!written_ || !writer_) return written_;
    recording::Metadata metadata = metadata_;
    metadata[recording::kQualitiesEntry] = fmt::format("{}", fmt::join(qualities_, ", "));
    return written_ = writer_->finish(metadata).and_then([&] { return file_.sync(); });
  }

  std::uint64_t frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  // Describes the frames that are coarser than quality 0; empty without any.
  std::string coarseFrames() const {
    const std::lock_guard lock(mutex_);
    const std::uint64_t fine = qualities_[0];
    if (fine == frames_) return {};
    std::string list;
    for (std::size_t quality = 1; quality < qualities_.size(); ++quality)
      if (qualities_[quality] > 0)
        list += fmt::format("{}{} of quality {}", list.empty() ? "" : ", ", qualities_[quality], quality);
    return fmt::format(
        "{} of {} frames are coarser than quality 0, because the connection or this machine was too "
        "slow: {}",
        frames_ - fine, frames_, list);
  }
  std::uint64_t bytes() const {
    const std::lock_guard lock(mutex_);
    return writer_ ? writer_->bytes() : 0;
  }

 private:
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
    metadata_ = {{"server", welcome_.server_name()},
                 {"scene", description.scene()},
                 {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
                 {"device", welcome_.device_name()},
                 {"codec", fmt::format("{}", description.codec())},
                 {"max_error", fmt::format("{}", description.max_error())},
                 {"vertices", fmt::format("{}", vertices)},
                 {"simulation_rate", fmt::format("{}", description.simulation_rate())},
                 {"stream_rate", fmt::format("{}", description.stream_rate())}};
    auto writer = recording::RecordingWriter::begin(
        [this](std::string_view bytes) { return file_.write(bytes); }, program_, metadata_);
    if (writer)
      writer_.emplace(std::move(*writer));
    else
      written_ = tl::unexpected(writer.error());
  }

  mutable std::mutex mutex_;
  recording::OutputFile file_;
  const std::string program_;
  const bool fullQuality_;
  const recording::RecordingClock clock_;
  recording::Written written_;
  std::optional<recording::RecordingWriter> writer_;  // set after the description
  v1::ServerMessage message_;
  v1::Welcome welcome_;
  std::string content_;
  std::optional<SteadyClock::time_point> chunkStart_;
  bool broken_ = false, coarse_ = false;
  recording::Metadata metadata_;
  std::uint64_t frames_ = 0;
  std::array<std::uint64_t, codec::kMaxQualities> qualities_{};  // frames by their quality
  std::uint32_t sinceKey_ = 0;                                   // frames since the last key frame
};

// Waits for the end of the time, a signal, the end of the stream or a write error.
std::optional<Error> follow(NativeClient& client, StreamFile& file, const RecordOptions& options) {
  const auto start = SteadyClock::now();
  StreamTime time(options.seconds);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  for (;;) {
    const auto wait = time.next(kInterval, file.frames());
    if (!wait || interrupted(*wait)) return std::nullopt;
    if (auto written = file.flush(); !written) return Error{kNotWritten, written.error()};
    if (file.broken())
      return Error{
          kLost,
          "the stream could not be resumed, because the connection was lost for too long or the server "
          "was restarted; the recording ends there"};
    if (file.coarse())
      return Error{kLost,
                   fmt::format("the server lowered the quality after {} frames, because the connection or "
                               "this machine is too slow for full quality; the recording ends there. Without "
                               "--full-quality it goes on",
                               file.frames())};
    if (const auto failure = client.ended()) return Error{exitCodeOf(failure->kind), failure->text};
    if (terminal) {
      const std::chrono::duration<double> passed = SteadyClock::now() - start;
      showStatus(stderr, fmt::format("{:.0f} s, {} frames, {:.1f} MiB", passed.count(), file.frames(),
                                     static_cast<double>(file.bytes()) / (1 << 20)));
    }
  }
}

}  // namespace

ExitCode record(const RecordOptions& options) {
  auto output = recording::OutputFile::create(options.output);
  if (!output) return printError(Error{kNotWritten, output.error()});
  StreamFile file(std::move(*output), options.program, options.fullQuality);
  NativeClientOptions clientOptions;
  clientOptions.scene = options.scene;
  clientOptions.clientName = "clothstream record";
  clientOptions.role = CS_ROLE_VIEWER;
  clientOptions.maxVertices = options.maxVertices;
  clientOptions.cancelled = [] { return interrupted(); };
  clientOptions.onMessage = [&](std::span<const std::byte> bytes) { file.receive(bytes); };
  const auto onEvents = [&](cs_client* core, std::uint32_t events) {
    if (events == 0 && cs_get_state(core) == CS_STATE_RECONNECTING)
      print(stderr,
            "clothstream: the connection is lost; reconnecting. Frames of this time will be missing.\n");
    if ((events & CS_EVENT_RETURNED) != 0 && cs_resumed(core) != 0)
      print(stderr, "clothstream: reconnected; the recording continues.\n");
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
  if (isatty(STDERR_FILENO) != 0) showStatus(stderr, "");
  if (auto finished = file.finish(); !finished && !problem) problem = Error{kNotWritten, finished.error()};
  print("{}: {}, {} frames in {:.1f} s, {:.1f} MiB; {} frames were lost\n", options.output, report.scene,
        file.frames(), report.seconds, static_cast<double>(file.bytes()) / (1 << 20),
        report.statistics.dropped);
  if (const std::string coarse = file.coarseFrames(); !coarse.empty()) print("{}\n", coarse);
  return problem ? printError(*problem) : kOk;
}

}  // namespace clothstream::cli
