// SPDX-License-Identifier: MIT
// Copies every readable chunk to a new recording and verifies the copy.
#include "clients/cli/recover.h"

#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "proto/recording/crc32.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_reader.h"
#include "proto/recording/recording_writer.h"

namespace clothstream::cli {
namespace {

using recording::CutFiles;
using recording::RecordingReader;

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
    crc = recording::crcOf(message.bytes, crc);
  }
};

struct Recovered {
  Sum sum;
  std::uint64_t lostChunks = 0;
  std::string firstLoss;
};

class Recovery {
 public:
  explicit Recovery(const RecoverOptions& options) : options_(options) {}

  Expected<Recovered> run() {
    auto damaged = orError(kUnreadable, RecordingReader::open(options_.recording, CutFiles::read));
    if (!damaged) return tl::unexpected(damaged.error());
    auto file = orError(kUnreadable, recording::openFile(options_.recording));
    if (!file) return tl::unexpected(file.error());
    auto mcap = orError(kUnreadable, recording::McapReader::open(std::move(*file)));
    if (!mcap) return tl::unexpected(mcap.error());
    auto out = orError(kNotWritten, recording::OutputFile::create(options_.out));
    if (!out) return tl::unexpected(out.error());
    auto recovered = copy(*damaged, *mcap, *out);
    if (recovered) {
      if (auto verified = verify(*recovered); !verified) recovered = tl::unexpected(verified.error());
    }
    if (!recovered) std::filesystem::remove(options_.out);
    return recovered;
  }

 private:
  Expected<Recovered> copy(const RecordingReader& damaged, recording::McapReader& mcap,
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
        if (recovered.lostChunks++ == 0) recovered.firstLoss = messages.error();
        continue;
      }
      for (const recording::Message& message : *messages) {
        const auto topic = damaged.topicOf(message.channel);
        if (!topic) continue;
        if (auto written = orError(kNotWritten, writer->write(*topic, message.time, message.bytes)); !written)
          return tl::unexpected(written.error());
        recovered.sum.add(message);
      }
    }
    if (recovered.sum.messages == 0)
      return makeError(kUnreadable, "{} has no readable messages", options_.recording);
    if (auto done = orError(kNotWritten, writer->finish().and_then([&] { return out.sync(); })); !done)
      return tl::unexpected(done.error());
    return recovered;
  }

  Expected<void> verify(const Recovered& recovered) const {
    auto reader = orError(kNotWritten, RecordingReader::open(options_.out));
    if (!reader) return tl::unexpected(reader.error());
    if (auto checked = orError(kNotWritten, reader->check()); !checked) return checked;
    Sum sum;
    for (;;) {
      const auto message = orError(kNotWritten, reader->next());
      if (!message) return tl::unexpected(message.error());
      if (!*message) break;
      sum.add({0, (*message)->time, (*message)->bytes});
    }
    if (sum != recovered.sum)
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
  fmt::print("{}: {} messages of {:.1f} s, complete and verified\n", options.out, sum.messages,
             static_cast<double>(sum.lastTime - sum.firstTime) * 1e-9);
  if (recovered->lostChunks == 0) return kOk;
  return printError(
      Error{kUnreadable, fmt::format("{} damaged chunks of {} are missing in {}: {}", recovered->lostChunks,
                                     options.recording, options.out, recovered->firstLoss)});
}

}  // namespace clothstream::cli
