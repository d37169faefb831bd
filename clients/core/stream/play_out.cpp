// SPDX-License-Identifier: MIT
// Ring buffer of frames, adaptive delay, interpolation and extrapolation.
#include "clients/core/stream/play_out.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "clients/core/stream/server_clock.h"
#include "proto/codec/vertex_normals.h"

namespace clothstream::client {
namespace {

constexpr double kMaxDelayMs = 10'000, kMaxLeadMs = 1000;
constexpr std::uint32_t kMaxFrames = 256;

// Returns false for NaN.
bool isWithin(double number, double most) {
  return number >= 0 && number <= most;
}

bool isUnit(float squared) {
  return squared >= 1e-30f && std::isfinite(squared);
}

// A collider that moves or turns more than this between two frames has jumped, by the server's rule
// (docs/protocol.md). A jump is not interpolated.
constexpr float kMaxSpeed = 30;       // m/s
constexpr float kLeastCosine = 0.5f;  // cosine of half the angle

bool isSame(const Collider& a, const Collider& b) {
  return a.participantId == b.participantId && a.name == b.name;
}

// Moves `moved` by `fraction` of the way from `from` to `to`. It starts as a copy of `from`, or of `to` for
// an extrapolation (isAtTo).
void move(Collider& moved, const Collider& from, const Collider& to, bool isAtTo, float fraction,
          float seconds) {
  Vec3 way{};
  float squared = 0, cosine = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    way[axis] = to.position[axis] - from.position[axis];
    squared += way[axis] * way[axis];
  }
  // Also rejects infinity and NaN.
  if (!(squared <= kMaxSpeed * kMaxSpeed * seconds * seconds)) return;
  for (std::size_t axis = 0; axis < 3; ++axis) moved.position[axis] += way[axis] * fraction;

  for (std::size_t i = 0; i < 4; ++i) cosine += from.orientation[i] * to.orientation[i];
  if (std::abs(cosine) < kLeastCosine) return;
  const float part = isAtTo ? 1 + fraction : fraction, sign = cosine < 0 ? -1.0f : 1.0f;
  std::array<float, 4> turned{};
  float length = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    turned[i] = (1 - part) * from.orientation[i] + sign * part * to.orientation[i];
    length += turned[i] * turned[i];
  }
  if (!isUnit(length)) return;
  for (std::size_t i = 0; i < 4; ++i) moved.orientation[i] = turned[i] / std::sqrt(length);
  if (from.joints.size() == to.joints.size()) moveJoints(from.joints, to.joints, part, moved.joints);
}

}  // namespace

bool isAllowed(const cs_play_out_options& options) {
  return options.version == CS_PLAY_OUT_OPTIONS_VERSION && options.frames >= PlayOut::kFewestFrames &&
         options.frames <= kMaxFrames &&
         (std::isnan(options.delay_ms) || isWithin(options.delay_ms, kMaxDelayMs)) &&
         isWithin(options.most_delay_ms, kMaxDelayMs) &&
         isWithin(options.least_delay_ms, options.most_delay_ms) && isWithin(options.lead_ms, kMaxLeadMs);
}

void PlayOut::begin(const Description& description) {
  const codec::StreamLayout& layout = description.layout;
  sendsNormals_ = layout.normals != codec::NormalMode::none;
  frameUs_ = 1e6 / description.streamRate;
  const std::size_t vertexBytes = (sendsNormals_ ? 6 : 3) * sizeof(float);
  const std::size_t vertices = std::max<std::size_t>(layout.vertexCount(), 1);
  const std::size_t fit = kMaxBytes / (vertices * vertexBytes);
  frames_.assign(std::clamp<std::size_t>(fit, kFewestFrames, options_.frames), {});
  positions_ = {};
  normals_ = {};
  colliders_ = {};
  forget();
}

void PlayOut::forget() {
  count_ = 0;
  delay_.forget();
  plays_ = false;
  shown_ = {};
}

std::size_t PlayOut::held() const {
  return std::min(count_, frames_.size());
}

const PlayOut::Frame& PlayOut::newest(std::size_t back) const {
  return frames_[(count_ - 1 - back) % frames_.size()];
}

void PlayOut::add(const DisplayableFrame& frame, std::uint64_t displayableUs) {
  if (count_ > 0 && since(newest(0).timeUs, frame.timeUs) <= 0) forget();
  if (count_ > 0 && displayableUs != 0) delay_.sample(since(newest(0).timeUs, displayableUs), displayableUs);
  if (plays_ && since(timeUs_, frame.timeUs) < 0) ++lateFrames_;
  Frame& slot = frames_[count_++ % frames_.size()];
  slot.tick = frame.tick;
  slot.timeUs = frame.timeUs;
  slot.key = frame.key;
  slot.positions.assign(frame.positions.begin(), frame.positions.end());
  slot.normals.assign(frame.normals.begin(), frame.normals.end());
  slot.colliders.assign(frame.colliders.begin(), frame.colliders.end());
}

cs_played PlayOut::play(std::uint64_t nowUs, std::uint64_t displayUs) {
  cs_played played{};
  shown_ = {};
  hasNormals_ = hasColliders_ = false;
  if (count_ == 0) return played;
  const bool adapts = std::isnan(options_.delay_ms);
  if (displayUs == 0 || (adapts && !delay_.known())) {
    shown_.base = &newest(0);
    played.shown = CS_SHOWN_HELD;
    played.tick = shown_.base->tick;
    return played;
  }
  if (adapts) {
    const auto elapsedUs = plays_ ? std::optional(std::max(0.0, since(displayUs_, displayUs))) : std::nullopt;
    delay_.move(since(nowUs, displayUs), elapsedUs, 1000 * options_.least_delay_ms,
                1000 * options_.most_delay_ms);
  } else {
    delay_.set(1000 * options_.delay_ms);
  }
  const std::uint64_t timeUs = displayUs - static_cast<std::uint64_t>(std::llround(delay_.us()));
  played.shown = choose(timeUs);
  if (plays_ && since(newest(0).timeUs, timeUs) > 0)
    (played.shown == CS_SHOWN_LED_ON ? ledOnUs_ : heldUs_) += std::max(0.0, since(timeUs_, timeUs));
  if (shown_.fraction != 0) blend(&Frame::positions, positions_);
  displayUs_ = displayUs;
  timeUs_ = played.server_time_us = timeUs;
  plays_ = true;
  played.tick = shown_.base->tick;
  played.fraction = shown_.fraction;
  return played;
}

cs_shown PlayOut::choose(std::uint64_t timeUs) {
  std::size_t back = 0;
  while (back + 1 < held() && since(newest(back).timeUs, timeUs) < 0) ++back;
  const Frame& frame = newest(back);
  const double past = since(frame.timeUs, timeUs);
  shown_.base = &frame;
  if (past == 0) return CS_SHOWN_FRAME;
  if (past < 0) return CS_SHOWN_HELD;
  if (back == 0) return chooseBeyond(frame, past);
  const Frame& next = newest(back - 1);
  shown_ = {&frame, &frame, &next, past / since(frame.timeUs, next.timeUs)};
  return CS_SHOWN_BETWEEN;
}

cs_shown PlayOut::chooseBeyond(const Frame& frame, double pastUs) {
  const double most = 1000 * options_.lead_ms;
  const double lead = pastUs <= most ? pastUs : 2 * most - pastUs;
  if (lead <= 0 || held() < 2 || frame.key) return CS_SHOWN_HELD;
  const Frame& before = newest(1);
  // A server that catches up sends frames faster than the simulated motion.
  const double step = std::max(frameUs_, since(before.timeUs, frame.timeUs));
  shown_ = {&frame, &before, &frame, lead / step};
  return CS_SHOWN_LED_ON;
}

void PlayOut::blend(std::vector<float> Frame::*values, std::vector<float>& out) const {
  const float* base = (shown_.base->*values).data();
  const float* from = (shown_.from->*values).data();
  const float* to = (shown_.to->*values).data();
  const auto fraction = static_cast<float>(shown_.fraction);
  out.resize((shown_.base->*values).size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = base[i] + (to[i] - from[i]) * fraction;
}

std::span<const float> PlayOut::positions() const {
  return shown_.fraction != 0 ? positions_ : shown_.base->positions;
}

std::span<const float> PlayOut::normals(const codec::StreamLayout& layout) {
  const std::vector<float>& own = shown_.base->normals;
  if (sendsNormals_ && shown_.fraction == 0) return own;
  if (hasNormals_) return normals_;
  hasNormals_ = true;
  if (!sendsNormals_) {
    normals_.resize(shown_.base->positions.size());
    codec::computeVertexNormals(layout, positions().data(), normals_.data());
    return normals_;
  }
  blend(&Frame::normals, normals_);
  for (std::size_t i = 0; i < normals_.size(); i += 3) {
    float* n = &normals_[i];
    const float squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    // Opposite normals may cancel.
    if (!isUnit(squared)) {
      std::copy_n(&own[i], 3, n);
      continue;
    }
    const float scale = 1.0f / std::sqrt(squared);
    for (int axis = 0; axis < 3; ++axis) n[axis] *= scale;
  }
  return normals_;
}

const std::vector<Collider>& PlayOut::colliders() {
  if (shown_.fraction == 0) return shown_.base->colliders;
  if (!hasColliders_) moveColliders();
  return colliders_;
}

void PlayOut::moveColliders() {
  hasColliders_ = true;
  const std::vector<Collider>& bases = shown_.base->colliders;
  colliders_.assign(bases.begin(), bases.end());
  const bool isAtTo = shown_.base == shown_.to;
  const auto fraction = static_cast<float>(shown_.fraction);
  const double stepUs = std::max(frameUs_, since(shown_.from->timeUs, shown_.to->timeUs));
  const std::vector<Collider>& others = (isAtTo ? shown_.from : shown_.to)->colliders;
  // Colliders have the same order in all frames.
  auto next = others.begin();
  for (std::size_t i = 0; i < bases.size(); ++i) {
    const Collider& base = bases[i];
    const auto other =
        std::find_if(next, others.end(), [&](const Collider& one) { return isSame(one, base); });
    if (other == others.end()) continue;
    next = other + 1;
    move(colliders_[i], isAtTo ? *other : base, isAtTo ? base : *other, isAtTo, fraction,
         static_cast<float>(stepUs * 1e-6));
  }
}

void PlayOut::report(cs_stage_statistics& out) const {
  out.frames_waiting = 0;
  while (plays_ && out.frames_waiting < held() && since(timeUs_, newest(out.frames_waiting).timeUs) > 0)
    ++out.frames_waiting;
  out.late_frames = lateFrames_;
  out.led_on_ms = ledOnUs_ / 1000;
  out.held_ms = heldUs_ / 1000;
  out.delay_ms = delay_.us() / 1000;
  out.wanted_delay_ms = delay_.wantedUs() / 1000;
}

}  // namespace clothstream::client
