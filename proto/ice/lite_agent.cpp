// SPDX-License-Identifier: MIT
#include "proto/ice/lite_agent.h"

namespace clothstream::ice {

std::vector<Datagram> LiteAgent::handle(const Address& from, std::span<const std::byte> datagram, Time now) {
  std::vector<Datagram> out;
  if (isOver(now)) return out;
  const auto message = readStun(datagram);
  if (!message) return out;
  if (auto answer = pairing_.answer(*message, datagram, from)) {
    out.push_back({.to = from, .bytes = std::move(answer->bytes)});
    if (answer->accepted) checked(from, answer->nominates, now, out);
  } else if (proof_ && from == proof_->address && message->transaction == proof_->transaction &&
             pairing_.isAuthenticResponse(*message, datagram)) {
    selected_ = from;
    lastCheck_ = now;
    proof_.reset();
  }
  return out;
}

// Handles a valid check. The first address that is proven is selected, and from then on those that the peer
// nominates.
void LiteAgent::checked(const Address& from, bool nominates, Time now, std::vector<Datagram>& out) {
  if (from == selected_) {
    lastCheck_ = now;
    return;
  }
  if (selected(now) && !nominates) return;
  const auto age = proof_ ? now - proof_->begun : kProofTime;
  const bool same = proof_ && proof_->address == from && age < kProofTime;
  if (!same && !nominates && age < kTurn) return;
  if (!same)
    proof_ = {
        .address = from, .transaction = newTransaction(), .begun = now, .sentAt = now, .repeated = false};
  proof_->sentAt = now;
  proof_->repeated = false;
  out.push_back({.to = from, .bytes = pairing_.check(proof_->transaction, false)});
}

std::vector<Datagram> LiteAgent::advance(Time now) {
  std::vector<Datagram> out;
  if (now < nextTime()) return out;
  proof_->repeated = true;
  if (!isOver(now))
    out.push_back({.to = proof_->address, .bytes = pairing_.check(proof_->transaction, false)});
  return out;
}

}  // namespace clothstream::ice
