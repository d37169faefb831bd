// SPDX-License-Identifier: MIT
#include "server/recording/frame_distance.h"

#include <span>
#include <utility>

namespace clothstream::recording {

Difference differenceOf(std::uint64_t tick, const std::vector<model::Vec3>& was,
                        const std::vector<model::Vec3>& is) {
  Difference difference{.tick = tick};
  for (std::size_t i = 0; i < was.size(); ++i) {
    const double distance = (is[i].cast<double>() - was[i].cast<double>()).norm();
    // The negated comparison counts NaN as the largest distance.
    if (!(distance <= difference.largest)) difference.largest = distance;
    difference.mean += distance / static_cast<double>(was.size());
  }
  return difference;
}

FrameDistance::FrameDistance(const codec::StreamLayout& layout) {
  if (auto check = FrameCheck::make(layout)) check_.emplace(std::move(*check));
}

void FrameDistance::add(std::uint64_t tick, std::vector<model::Vec3> positions) {
  if (waiting_.size() == kMaxWaiting) waiting_.pop_front();
  waiting_.push_back({tick, std::move(positions)});
}

void FrameDistance::take(std::string_view bytes, double seconds) {
  if (!check_) return unknown_.addUndecodable(std::nullopt, seconds);
  if (check_->take(bytes, seconds) != FrameCheck::Outcome::decoded) return;
  const codec::Decoder& decoder = check_->decoder();
  while (!waiting_.empty() && waiting_.front().tick < decoder.tick()) waiting_.pop_front();
  if (waiting_.empty() || waiting_.front().tick != decoder.tick()) return;
  const std::span<const float> shown = decoder.positions();
  std::vector<model::Vec3> was;
  was.reserve(shown.size() / 3);
  for (std::size_t i = 0; i + 2 < shown.size(); i += 3)
    was.emplace_back(shown[i], shown[i + 1], shown[i + 2]);
  const Difference difference = differenceOf(decoder.tick(), was, waiting_.front().positions);
  if (frames_++ == 0 || !(difference.largest <= largest_.largest)) largest_ = difference;
}

}  // namespace clothstream::recording
