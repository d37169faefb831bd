// SPDX-License-Identifier: MIT
// Copies every readable chunk to a new recording and verifies the copy.
#include "clients/cli/recover.h"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "proto/checksum/crc32.h"
#include "proto/recording/file.h"
#include "proto/recording/frame_check.h"
#include "proto/recording/message_types.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"
#include "proto/recording/recording_writer.h"

namespace clothstream::cli {
namespace {

using recording::CutFiles;
using recording::FrameCheck;
using recording::RecordingReader;
using recording::Topic;

template <typename T>
using Expected = tl::expected<T, Error>;

// Checksum over all messages that were read or written.
struct Sum {
  std::uint64_t messages = 0, firstTime = 0, lastTime = 0;
  std::uint32_t crc = 0;
  bool operator==(const Sum&) const = default;

  void add(const recording::Message& message) {
    if (messages++ == 0) firstTime = message.time;
    lastTime = message.time;
    crc = checksum::crc32(message.bytes, crc);
  }
};

struct Recovered {
  Sum sum;
  std::uint64_t lostChunks = 0, lostMessages = 0;
  std::string firstChunk, firstMessage;  // why the first of them is lost
  std::string frames;                    // which frames are lost

  // Describes everything that is not in the result; empty: nothing.
  std::string loss() const {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
    if (lostChunks > 0) add(fmt::format("{} damaged chunks: {}", lostChunks, firstChunk));
    if (!frames.empty()) add(frames);
    if (lostMessages > 0)
      add(fmt::format("{} messages cannot be read, the first is in {}", lostMessages, firstMessage));
    return text;
  }
};

// Frames that a recording can have: those that decode to their recorded hash.
class WholeFrames {
 public:
  // Without a description no frame can be decoded. One that exceeds the limits is an error.
  static Expected<WholeFrames> of(RecordingReader& reader, const std::string& path) {
    v1::StreamDescription description;
    const auto bytes = reader.description();
    if (!bytes || !description.ParseFromString(*bytes)) return WholeFrames(std::nullopt);
    if (const std::string problem = recording::sizeProblemOf(description, reader.limits()); !problem.empty())
      return makeError(kUnreadable, "{}: the description of its stream has {}", path, problem);
    auto check = FrameCheck::make(recording::layoutOf(description));
    return WholeFrames(check ? std::optional(std::move(*check)) : std::nullopt);
  }

  bool take(std::string_view frame, double seconds) {
    if (check_) return check_->take(frame, seconds) != FrameCheck::Outcome::faulty;
    unknown_.addUndecodable(std::nullopt, seconds);
    return false;
  }
  std::string faults() const { return (check_ ? check_->faults() : unknown_).text(); }

 private:
  explicit WholeFrames(std::optional<FrameCheck> check) : check_(std::move(check)) {}

  std::optional<FrameCheck> check_;
  recording::FrameFaults unknown_;
};

class Recovery {
 public:
  explicit Recovery(const RecoverOptions& options) : options_(options) {}

  Expected<Recovered> run() {
    auto damaged =
        orError(kUnreadable, RecordingReader::open(options_.recording, CutFiles::read, options_.limits));
    if (!damaged) return tl::unexpected(damaged.error());
    auto file = orError(kUnreadable, recording::openFile(options_.recording));
    if (!file) return tl::unexpected(file.error());
    auto mcap = orError(kUnreadable, recording::McapReader::open(std::move(*file), options_.limits.mcap()));
    if (!mcap) return tl::unexpected(mcap.error());
    auto whole = WholeFrames::of(*damaged, options_.recording);
    if (!whole) return tl::unexpected(whole.error());
    auto out = orError(kNotWritten, recording::OutputFile::create(options_.out));
    if (!out) return tl::unexpected(out.error());
    auto recovered = copy(*damaged, *mcap, *whole, *out);
    if (recovered) {
      if (auto verified = verify(*recovered); !verified) recovered = tl::unexpected(verified.error());
    }
    if (!recovered) std::filesystem::remove(options_.out);
    return recovered;
  }

 private:
  Expected<Recovered> copy(const RecordingReader& damaged, recording::McapReader& mcap, WholeFrames& whole,
                           recording::OutputFile& out) {
    auto writer = orError(kNotWritten, recording::RecordingWriter::begin(
                                           [&](std::string_view bytes) { return out.write(bytes); },
                                           mcap.library() + "; clothstream recover", damaged.metadata()));
    if (!writer) return tl::unexpected(writer.error());
    Recovered recovered;
    Progress progress("recover", static_cast<std::uint32_t>(mcap.chunks().size()));
    for (std::size_t i = 0; i < mcap.chunks().size(); ++i) {
      if (interrupted()) return makeError(kNotWritten, "interrupted; {} was not written", options_.out);
      progress.show(static_cast<std::uint32_t>(i));
      const auto messages = mcap.read(i);
      if (!messages) {
        if (recovered.lostChunks++ == 0) recovered.firstChunk = messages.error();
        continue;
      }
      for (const recording::Message& message : *messages) {
        const auto topic = damaged.topicOf(message.channel);
        if (!topic) continue;
        if (*topic == Topic::frames) {
          if (!whole.take(message.bytes, static_cast<double>(message.time - damaged.start()) * 1e-9))
            continue;
        } else if (!recording::isReadable(*topic, message.bytes)) {
          if (recovered.lostMessages++ == 0) recovered.firstMessage = nameOf(*topic);
          continue;
        }
        if (auto written = orError(kNotWritten, writer->write(*topic, message.time, message.bytes)); !written)
          return tl::unexpected(written.error());
        recovered.sum.add(message);
      }
    }
    recovered.frames = whole.faults();
    if (recovered.sum.messages == 0)
      return makeError(kUnreadable, "{} has no readable messages", options_.recording);
    if (auto done = orError(kNotWritten, writer->finish().and_then([&] { return out.sync(); })); !done)
      return tl::unexpected(done.error());
    return recovered;
  }

  Expected<void> verify(const Recovered& recovered) const {
    auto reader =
        orError(kNotWritten, RecordingReader::open(options_.out, CutFiles::refused, options_.limits));
    if (!reader) return tl::unexpected(reader.error());
    if (auto checked = orError(kNotWritten, reader->check()); !checked) return checked;
    Sum sum;
    auto whole = WholeFrames::of(*reader, options_.out);
    if (!whole) return tl::unexpected(whole.error());
    for (;;) {
      const auto message = orError(kNotWritten, reader->next());
      if (!message) return tl::unexpected(message.error());
      if (!*message) break;
      sum.add({0, (*message)->time, (*message)->bytes});
      if ((*message)->topic == Topic::frames) whole->take((*message)->bytes, 0);
    }
    if (sum != recovered.sum || !whole->faults().empty())
      return makeError(kNotWritten, "{} differs from what was written; it was removed", options_.out);
    return {};
  }

  const RecoverOptions& options_;
};

}  // namespace

ExitCode recover(const RecoverOptions& options) {
  const auto recovered = Recovery(options).run();
  if (!recovered) return printError(recovered.error());
  const Sum& sum = recovered->sum;
  const std::string loss = recovered->loss();
  print("{}: {} messages of {:.1f} s, {}\n", options.out, sum.messages,
        static_cast<double>(sum.lastTime - sum.firstTime) * 1e-9,
        loss.empty() ? "complete and verified" : "verified, but not complete");
  if (loss.empty()) return kOk;
  return printError(Error{kUnreadable, fmt::format("missing in {}, because {} is damaged: {}", options.out,
                                                   options.recording, loss)});
}

}  // namespace clothstream::cli
