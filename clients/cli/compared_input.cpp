// SPDX-License-Identifier: MIT
// Reads the journals of both recordings side by side, one topic at a time.
#include "clients/cli/compared_input.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "clients/cli/message_difference.h"
#include "clients/cli/signals.h"
#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {
namespace {

using recording::RecordingReader;
using recording::Topic;

// Messages of one topic in their order. Chunks that cannot be read are left out; messages that cannot be read
// are left out and counted.
template <typename MessageType>
class Journal {
 public:
  Journal(RecordingReader& reader, Topic topic, std::uint64_t& unreadable)
      : reader_(reader), topic_(topic), unreadable_(unreadable) {}

  // Continues to the next message. Returns false at the end.
  bool next() {
    for (;;) {
      while (next_ < found_.size()) {
        const std::string_view bytes = found_[next_++].bytes;
        if (message_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return true;
        ++unreadable_;
      }
      if (chunk_ == reader_.mcap().chunks().size()) return false;
      auto found = reader_.messages(chunk_++, topic_);
      found_ = found ? std::move(*found) : std::vector<recording::RecordedMessage>();
      next_ = 0;
    }
  }

  MessageType& message() { return message_; }

 private:
  RecordingReader& reader_;
  Topic topic_;
  std::uint64_t& unreadable_;
  std::vector<recording::RecordedMessage> found_;
  std::size_t chunk_ = 0, next_ = 0;
  MessageType message_;
};

using Readers = std::array<RecordingReader, 2>;

// Removes what a tick made, so that its input remains.
v1::RecordedTick inputOf(v1::RecordedTick tick) {
  tick.clear_state_hash();
  tick.clear_unhealthy();
  tick.clear_keeps_state();
  return tick;
}

bool compareTicks(Readers& readers, ComparedInput& result) {
  Journal<v1::RecordedTick> a(readers[0], Topic::ticks, result.unreadable[0]),
      b(readers[1], Topic::ticks, result.unreadable[1]);
  bool moreA = a.next(), moreB = b.next();
  while (moreA || moreB) {
    if (interrupted()) return false;
    const bool takesA = moreA && (!moreB || a.message().tick() <= b.message().tick());
    const bool takesB = moreB && (!moreA || b.message().tick() <= a.message().tick());
    if (takesA && takesB) {
      ++result.commonTicks;
      const std::uint64_t tick = a.message().tick();
      // NaNs may have different bits.
      const bool bothUnhealthy = a.message().unhealthy() && b.message().unhealthy();
      if (!bothUnhealthy && a.message().state_hash() != b.message().state_hash()) {
        ++result.differentTicks;
        if (!result.firstDifferent) result.firstDifferent = tick;
      }
      if (result.ticks.text.empty())
        result.ticks = {tick, differenceOf(inputOf(a.message()), inputOf(b.message()))};
    } else {
      ++result.onlyTicks[takesA ? 0 : 1];
    }
    if (takesA) moreA = a.next();
    if (takesB) moreB = b.next();
  }
  return true;
}

// Compares messages in their order.
template <typename MessageType>
InputDifference compareInOrder(Readers& readers, Topic topic, const char* what, ComparedInput& result) {
  Journal<MessageType> a(readers[0], topic, result.unreadable[0]), b(readers[1], topic, result.unreadable[1]);
  for (std::uint64_t count = 0;; ++count) {
    const bool moreA = a.next(), moreB = b.next();
    if (!moreA && !moreB) return {};
    InputDifference difference;
    if (moreA && moreB)
      difference.text = differenceOf(a.message(), b.message());
    else
      difference.text =
          fmt::format("{} has {} {}, {} has more", moreA ? "B" : "A", count, what, moreA ? "A" : "B");
    if (difference.text.empty()) continue;
    if constexpr (requires { a.message().tick(); }) difference.tick = (moreA ? a : b).message().tick();
    return difference;
  }
}

// Compares what a decoder needs, and the definition of the scene.
InputDifference compareScenes(Readers& readers, ComparedInput& result) {
  InputDifference difference = compareInOrder<v1::RecordedScene>(readers, Topic::scene, "scenes", result);
  if (!difference.text.empty()) return difference;
  Journal<v1::StreamDescription> a(readers[0], Topic::description, result.unreadable[0]),
      b(readers[1], Topic::description, result.unreadable[1]);
  if (!a.next() || !b.next()) return {};
  // The number of the epoch says nothing about the scene.
  a.message().clear_epoch();
  b.message().clear_epoch();
  return {{}, differenceOf(a.message(), b.message())};
}

}  // namespace

tl::expected<ComparedInput, Error> compareInput(const std::array<std::string, 2>& paths,
                                                const recording::ReadLimits& limits) {
  auto a = orError(kUnreadable, RecordingReader::open(paths[0], recording::CutFiles::read, limits));
  if (!a) return tl::unexpected(a.error());
  auto b = orError(kUnreadable, RecordingReader::open(paths[1], recording::CutFiles::read, limits));
  if (!b) return tl::unexpected(b.error());
  Readers readers{std::move(*a), std::move(*b)};
  ComparedInput result;
  result.kernels = recording::compareKernels(readers[0].metadata(recording::kKernelsEntry),
                                             readers[1].metadata(recording::kKernelsEntry));
  for (std::size_t i = 0; i < readers.size(); ++i)
    result.devices[i] = fmt::format("{} ({})", readers[i].metadata("device"), readers[i].metadata("driver"));
  result.scene = compareScenes(readers, result);
  result.parameters =
      compareInOrder<v1::ParameterChanged>(readers, Topic::parameters, "changes of parameters", result);
  result.participants =
      compareInOrder<v1::ParticipantEvent>(readers, Topic::participants, "joins and leaves", result);
  if (!compareTicks(readers, result)) return makeError(kFailed, "interrupted");
  return result;
}

}  // namespace clothstream::cli
