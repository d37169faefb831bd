// SPDX-License-Identifier: MIT
// Collects and restores snapshots of the parameters of a recording.
#include "server/recording/parameter_history.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace clothstream::recording {
namespace {

constexpr std::uint64_t kWholeChunk = std::numeric_limits<std::uint64_t>::max();

// Applies the changes in the chunk up to this time. Returns whether the chunk holds any changes.
bool applyChunk(RecordingReader& reader, std::size_t chunk, std::uint64_t time,
                ParametersInForce& parameters) {
  const auto messages = reader.messages(chunk, Topic::parameters);
  if (!messages) return false;  // playback reports the damage
  v1::ParameterChanged message;
  for (const RecordedMessage& recorded : *messages)
    if (recorded.time <= time &&
        message.ParseFromArray(recorded.bytes.data(), static_cast<int>(recorded.bytes.size())))
      parameters.apply(message.change());
  return !messages->empty();
}

}  // namespace

ParameterHistory::ParameterHistory(RecordingReader& reader, const v1::StreamDescription& description,
                                   std::size_t maxBytes) {
  ParametersInForce now(description);
  keep(now, maxBytes);
  for (std::size_t chunk = 0; chunk < reader.mcap().chunks().size(); ++chunk) {
    if (!applyChunk(reader, chunk, kWholeChunk, now)) continue;
    chunks_.push_back(chunk);
    if (chunks_.size() % stride_ == 0) keep(now, maxBytes);
  }
}

void ParameterHistory::keep(const ParametersInForce& parameters, std::size_t maxBytes) {
  bytes_ += kept_.emplace_back(parameters.now().SerializeAsString()).size();
  while (bytes_ > maxBytes && kept_.size() > 1) {
    std::size_t left = 0;
    bytes_ = 0;
    for (std::size_t i = 0; i < kept_.size(); i += 2) {
      if (i != left) kept_[left] = std::move(kept_[i]);
      bytes_ += kept_[left++].size();
    }
    kept_.resize(left);
    stride_ *= 2;
  }
}

ParametersInForce ParameterHistory::at(std::uint64_t time, RecordingReader& reader) const {
  const auto startOf = [&](std::size_t chunk) { return reader.mcap().chunks()[chunk].start; };
  const auto after = std::ranges::upper_bound(chunks_, time, {}, startOf);
  const auto count = static_cast<std::size_t>(after - chunks_.begin());
  const std::size_t first = count == 0 ? 0 : (count - 1) / stride_;
  v1::ParameterChange all;
  all.ParseFromString(kept_[first]);
  ParametersInForce parameters(std::move(all));
  for (std::size_t i = first * stride_; i < count; ++i) applyChunk(reader, chunks_[i], time, parameters);
  return parameters;
}

}  // namespace clothstream::recording
