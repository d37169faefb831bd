// SPDX-License-Identifier: MIT
#include "clients/xr/input/own_input.h"

namespace clothstream::xr {

void InputSender::send(cs_client* client, const OwnInput& input, std::uint64_t atUs) {
  for (const Side side : {Side::left, Side::right}) {
    const std::size_t i = indexOf(side);
    const std::uint32_t csSide = side == Side::left ? CS_HAND_LEFT : CS_HAND_RIGHT;
    if (input.hasHand[i] || hands_[i])
      cs_set_hand(client, csSide, input.hands[i].data(), input.hasHand[i] ? CS_HAND_JOINTS : 0, atUs);
    hands_[i] = input.hasHand[i];
  }
  if (input.hasHead) {
    cs_set_head(client, input.head.position.data(), input.head.orientation.coeffs().data(), input.headRadius,
                atUs);
  } else if (head_) {
    cs_set_head(client, nullptr, nullptr, 0, atUs);
  }
  head_ = input.hasHead;
  if (input.colliderCount > 0 || colliders_)
    cs_set_colliders(client, input.colliders.data(), input.colliderCount, atUs);
  colliders_ = input.colliderCount > 0;
  if (input.grabCount > 0 || grabs_) cs_set_grabs(client, input.grabs.data(), input.grabCount, atUs);
  grabs_ = input.grabCount > 0;
}

}  // namespace clothstream::xr
