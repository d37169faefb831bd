// SPDX-License-Identifier: MIT
#include "server/recording/frame_distance.h"

#include <span>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/encode/frame_encoder.h"
#include "server/scene/live_scene.h"

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

FrameDistance::FrameDistance(const model::Scene& scene)
    : decoder_(codec::Decoder::make(encode::streamLayout(scene, scene::LiveScene::kEpoch))) {}

void FrameDistance::add(std::uint64_t tick, std::vector<model::Vec3> positions) {
  if (waiting_.size() == kMaxWaiting) waiting_.pop_front();
  waiting_.push_back({tick, std::move(positions)});
}

void FrameDistance::take(std::string_view bytes) {
  v1::Frame frame;
  if (!decoder_ || !frame.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  if (decoder_->decode(std::as_bytes(std::span(frame.packet()))) != codec::DecodeResult::ok) return;
  while (!waiting_.empty() && waiting_.front().tick < decoder_->tick()) waiting_.pop_front();
  if (waiting_.empty() || waiting_.front().tick != decoder_->tick()) return;
  const std::span<const float> shown = decoder_->positions();
  std::vector<model::Vec3> was;
  was.reserve(shown.size() / 3);
  for (std::size_t i = 0; i + 2 < shown.size(); i += 3)
    was.emplace_back(shown[i], shown[i + 1], shown[i + 2]);
  const Difference difference = differenceOf(decoder_->tick(), was, waiting_.front().positions);
  if (frames_++ == 0 || !(difference.largest <= largest_.largest)) largest_ = difference;
}

}  // namespace clothstream::recording
