// SPDX-License-Identifier: MIT
// Order of messages: proof of identity, Hello, offer of datagrams, control, acknowledgement, poses.
#include "clients/core/stream/outbox.h"

namespace clothstream::client {

bool Outbox::addControl(std::string message) {
  if (control_.size() == kMaxControl) return false;
  control_.push_back(std::move(message));
  return true;
}

void Outbox::clear() {
  proof_.clear();
  hello_.clear();
  offer_.clear();
  control_.clear();
  poses_.clear();
  ackTick_.reset();
}

const std::string* Outbox::next() {
  if (!proof_.empty()) {
    taken_.swap(proof_);
    proof_.clear();
  } else if (!hello_.empty()) {
    taken_.swap(hello_);
    hello_.clear();
  } else if (!offer_.empty()) {
    taken_.swap(offer_);
    offer_.clear();
  } else if (!control_.empty()) {
    taken_ = std::move(control_.front());
    control_.pop_front();
  } else if (ackTick_) {
    writeFrameAck(taken_, *ackTick_);
    ackTick_.reset();
  } else if (!poses_.empty()) {
    taken_.swap(poses_);
    poses_.clear();
  } else {
    return nullptr;
  }
  return &taken_;
}

}  // namespace clothstream::client
