// SPDX-License-Identifier: MIT
// What the program shows: play-out of the frames, and contact with the own hand.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/play_out.h"
#include "clients/core/stream/server_clock.h"
#include "clients/core/touch/contact.h"
#include "clients/core/touch/own_capsules.h"
#include "clients/core/wire/client_message.h"
#include "clients/core/wire/description.h"

namespace clothstream::client {

// Play-out and local contact are off at the start. A stream must have begun before frames are added.
class Display {
 public:
  // Null turns play-out off. Returns false, and changes nothing, if the options are not allowed. `stream` is
  // that of the scene; null if none has begun.
  bool setPlayOut(const cs_play_out_options* options, const Description* stream);
  void setLocalContact(bool on, const Description* stream);
  bool playsOut() const { return playOut_ != nullptr; }

  // Starts a stream. Forgets all frames.
  void begin(const Description& stream);
  // Adds a frame to the play-out; see PlayOut::add().
  void add(const DisplayableFrame& frame, std::uint64_t displayableUs) {
    playOut_->add(frame, displayableUs);
  }
  // The participant has moved its colliders.
  void moved(const Poses& poses, std::uint64_t nowUs);
  // Chooses what to show; nullopt if play-out is off. Both times are of the own clock. Colliders of
  // `participant` correct the cloth if there is local contact; 0: none do.
  std::optional<cs_played> play(const ServerClock& clock, std::uint64_t nowUs, std::uint64_t displayUs,
                                std::uint64_t participant);

  // Whether the last play() chose what to show, and that is still known. The next four functions require it.
  bool shows() const { return playOut_ && playOut_->shows(); }
  std::uint64_t tick() const { return tick_; }
  std::span<const float> positions() const;
  std::span<const float> normals(const codec::StreamLayout& layout) const;
  const std::vector<Collider>& colliders() const { return playOut_->colliders(); }

  // Length of the largest correction of the last play(), m.
  float largestCorrection() const { return corrected_.empty() ? 0 : contact_->largest(); }
  // Fills in the members about play-out.
  void report(cs_stage_statistics& out) const;

 private:
  void correct(const cs_played& played, const ServerClock& clock, std::uint64_t displayUs,
               std::uint64_t participant);

  std::unique_ptr<PlayOut> playOut_;
  std::unique_ptr<Contact> contact_;  // present if local contact is on
  CapsuleHistory ownCapsules_;        // used if local contact is on
  std::span<const float> corrected_;  // positions; empty if contact has corrected none
  std::uint64_t tick_ = 0;            // of the last play()
};

}  // namespace clothstream::client
