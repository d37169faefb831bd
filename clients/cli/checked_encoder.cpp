// SPDX-License-Identifier: MIT
#include "clients/cli/checked_encoder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "proto/codec/reach.h"

namespace clothstream::cli {
namespace {

double millisecondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double largestDistance(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const auto off = [&](std::size_t c) { return double{a[i + c]} - double{b[i + c]}; };
    largest = std::max(largest, off(0) * off(0) + off(1) * off(1) + off(2) * off(2));
  }
  return std::sqrt(largest);
}

}  // namespace

CheckedEncoder::CheckedEncoder(float maxError, std::string name, std::unique_ptr<codec::Encoder> encoder,
                               std::unique_ptr<codec::Decoder> decoder)
    : maxError_(maxError),
      reach_(codec::reachOf(maxError)),
      name_(std::move(name)),
      encoder_(std::move(encoder)),
      decoder_(std::move(decoder)),
      packet_(encoder_->packetBound()) {}

tl::expected<CheckedEncoder, Error> CheckedEncoder::make(const codec::StreamLayout& layout,
                                                         std::string name) {
  auto encoder = codec::Encoder::make(layout);
  if (!encoder) return makeError(kUnreadable, "{} cannot be encoded: its cloths are not possible", name);
  auto decoder = codec::Decoder::make(layout);
  if (!decoder) return makeError(kFailed, "not enough memory for {} vertices", layout.vertexCount());
  return CheckedEncoder(layout.maxError, std::move(name), std::move(encoder), std::move(decoder));
}

double CheckedEncoder::promise() const {
  return codec::promisedDistance(maxError_, farthest_);
}

tl::expected<std::span<const std::byte>, Error> CheckedEncoder::encode(std::uint64_t tick,
                                                                       codec::PacketKind kind,
                                                                       std::span<const float> positions) {
  const auto magnitude = [](float x) { return std::abs(x); };
  const auto far = std::ranges::max_element(positions, {}, magnitude);
  if (std::abs(*far) > reach_)
    return makeError(
        kUnreadable,
        "{}: in frame {}, vertex {} has a coordinate of {} m; a max error of {} m allows at most {} m. "
        "Use a max error of {} m or more, or move the motion nearer to the origin",
        name_, frame_, (far - positions.begin()) / 3, *far, maxError_, reach_,
        codec::maxErrorFor(std::abs(*far)));
  farthest_ = std::max(farthest_, std::abs(*far));
  std::size_t bytes = 0;
  encodeMs_ += millisecondsOf([&] { bytes = encoder_->encode(tick, kind, positions, {}, packet_); });
  const auto packet = std::span<const std::byte>(packet_).first(bytes);
  codec::DecodeResult result{};
  decodeMs_ += millisecondsOf([&] { result = decoder_->decode(packet); });
  if (result != codec::DecodeResult::ok || decoder_->reconstructionHash() != encoder_->reconstructionHash())
    return makeError(kHashMismatch, "{}: frame {} decodes to something else than was encoded", name_, frame_);
  largestError_ = std::max(largestError_, largestDistance(positions, decoder_->positions()));
  if (largestError_ > promise())
    return makeError(kHashMismatch, "{}: in frame {} a vertex has an error of {} m; promised {} m", name_,
                     frame_, largestError_, promise());
  ++frame_;
  return packet;
}

}  // namespace clothstream::cli
