// SPDX-License-Identifier: MIT
// Every chunk that can be read, written anew and read again.
#include "clients/cli/recover.h"

#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "clients/cli/complaint.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_reader.h"
#include "proto/recording/recording_writer.h"

namespace clothstream::cli {
namespace {

using recording::CutFiles;
using recording::RecordingReader;

template <typename T>
using Expected = tl::expected<T, Complaint>;

// Of what was read or written, all messages together.
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
    auto facts = orComplaint(kUnreadable, RecordingReader::open(options_.recording, CutFiles::read));
    if (!facts) return tl::unexpected(facts.error());
    auto file = orComplaint(kUnreadable, recording::openFile(options_.recording));
    if (!file) return tl::unexpected(file.error());
    auto mcap = orComplaint(kUnreadable, recording::McapReader::open(std::move(*file)));
    if (!mcap) return tl::unexpected(mcap.error());
    auto out = orComplaint(kNotWritten, recording::OutputFile::create(options_.out));
    if (!out) return tl::unexpected(out.error());
    auto recovered = copy(*facts, *mcap, *out);
    if (recovered) {
      if (auto verified = verify(*recovered); !verified) recovered = tl::unexpected(verified.error());
    }
    if (!recovered) std::filesystem::remove(options_.out);
    return recovered;
  }

 private:
  Expected<Recovered> copy(const RecordingReader& facts, recording::McapReader& mcap,
                           recording::OutputFile& out) {
    auto writer = orComplaint(kNotWritten, recording::RecordingWriter::begin(
                                               [&](std::string_view bytes) { return out.write(bytes); },
                                               mcap.library() + "; clothstream recover", facts.facts()));
    if (!writer) return tl::unexpected(writer.error());
    Recovered recovered;
    Progress progress("recover", static_cast<std::uint32_t>(mcap.chunks().size()));
    for (std::size_t i = 0; i < mcap.chunks().size(); ++i) {
      if (interrupted()) return complaint(kNotWritten, "interrupted; {} is not written", options_.out);
      progress.show(static_cast<std::uint32_t>(i));
      const auto messages = mcap.read(i);
      if (!messages) {
        if (recovered.lostChunks++ == 0) recovered.firstLoss = messages.error();
        continue;
      }
      for (const recording::Message& message : *messages) {
        const auto topic = facts.topicOf(message.channel);
        if (!topic) continue;
        if (auto written = orComplaint(kNotWritten, writer->write(*topic, message.time, message.bytes));
            !written)
          return tl::unexpected(written.error());
        recovered.sum.add(message);
      }
    }
    if (recovered.sum.messages == 0)
      return complaint(kUnreadable, "there is nothing in {} that could be recovered", options_.recording);
    if (auto done = orComplaint(kNotWritten, writer->finish().and_then([&] { return out.sync(); })); !done)
      return tl::unexpected(done.error());
    return recovered;
  }

  Expected<void> verify(const Recovered& recovered) const {
    auto reader = orComplaint(kNotWritten, RecordingReader::open(options_.out));
    if (!reader) return tl::unexpected(reader.error());
    if (auto checked = orComplaint(kNotWritten, reader->check()); !checked) return checked;
    Sum sum;
    for (;;) {
      const auto message = orComplaint(kNotWritten, reader->next());
      if (!message) return tl::unexpected(message.error());
      if (!*message) break;
      sum.add({0, (*message)->time, (*message)->bytes});
    }
    if (sum != recovered.sum)
      return complaint(kNotWritten, "{} is not read as it was written; it is removed", options_.out);
    return {};
  }

  const RecoverOptions& options_;
};

}  // namespace

ExitCode recover(const RecoverOptions& options) {
  const auto recovered = Recovery(options).run();
  if (!recovered) return say(recovered.error());
  const Sum& sum = recovered->sum;
  fmt::print("{}: {} messages of {:.1f} s, read again and whole\n", options.out, sum.messages,
             static_cast<double>(sum.lastTime - sum.firstTime) * 1e-9);
  if (recovered->lostChunks == 0) return kOk;
  return say({kUnreadable, fmt::format("{} damaged chunks of {} are not in {}: {}", recovered->lostChunks,
                                       options.recording, options.out, recovered->firstLoss)});
}

}  // namespace clothstream::cli
