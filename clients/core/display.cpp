// SPDX-License-Identifier: MIT
#include "clients/core/display.h"

#include <algorithm>

namespace clothstream::client {

bool Display::setPlayOut(const cs_play_out_options* options, const Description* stream) {
  if (options && !isAllowed(*options)) return false;
  corrected_ = {};
  playOut_ = options ? std::make_unique<PlayOut>(*options) : nullptr;
  if (playOut_ && stream) playOut_->begin(*stream);
  return true;
}

void Display::setLocalContact(bool on, const Description* stream) {
  corrected_ = {};
  ownCapsules_ = {};
  contact_ = on ? std::make_unique<Contact>() : nullptr;
  if (contact_ && stream) contact_->begin(*stream);
}

void Display::begin(const Description& stream) {
  if (playOut_) playOut_->begin(stream);
  if (contact_) contact_->begin(stream);
  corrected_ = {};
}

void Display::moved(const Poses& poses, std::uint64_t nowUs) {
  if (contact_) ownCapsules_.add(ownCapsules(poses), nowUs);
}

std::optional<cs_played> Display::play(const ServerClock& clock, std::uint64_t nowUs, std::uint64_t displayUs,
                                       std::uint64_t participant) {
  if (!playOut_) return std::nullopt;
  corrected_ = {};
  const cs_played played = playOut_->play(clock.serverTimeUs(nowUs), clock.serverTimeUs(displayUs));
  tick_ = played.tick;
  if (contact_) correct(played, clock, displayUs, participant);
  return played;
}

// The frame states where the server saw the capsules. If they are not recognised, they are taken as they were
// when the frame was simulated, less the way of the message to the server.
void Display::correct(const cs_played& played, const ServerClock& clock, std::uint64_t displayUs,
                      std::uint64_t participant) {
  if (ownCapsules_.empty() || participant == 0 || played.server_time_us == 0 || !playOut_->shows()) return;
  const double ageUs =
      since(played.server_time_us, clock.serverTimeUs(displayUs)) + 500 * clock.roundTripMs();
  const auto age = static_cast<std::uint64_t>(std::clamp(ageUs, 0.0, static_cast<double>(displayUs)));
  const OwnCapsules sent = ownCapsules_.at(displayUs - age);
  const OwnCapsules answered = capsulesOf(playOut_->colliders(), participant, sent).value_or(sent);
  const std::span<const float> shown =
      contact_->apply(playOut_->positions(), answered, ownCapsules_.newest(), displayUs);
  if (contact_->largest() > 0) corrected_ = shown;
}

std::span<const float> Display::positions() const {
  return corrected_.empty() ? playOut_->positions() : corrected_;
}

std::span<const float> Display::normals(const codec::StreamLayout& layout) const {
  return corrected_.empty() ? playOut_->normals(layout) : contact_->normals(layout);
}

void Display::report(cs_stage_statistics& out) const {
  if (playOut_) playOut_->report(out);
}

}  // namespace clothstream::client
