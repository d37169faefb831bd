// SPDX-License-Identifier: MIT
#include "clients/datagram/association.h"

#include <algorithm>
#include <random>
#include <utility>

namespace clothstream {
namespace {

sctp::DataChannel::Options randomChannel() {
  std::random_device random;
  return {.label = "clothstream", .association = {.tag = std::max(random(), 1u), .firstTsn = random()}};
}

}  // namespace

using State = dtls::DtlsChannel::State;

Association::Association(const dtls::DtlsContext& context, ice::Credentials local, const DatagramPeer& peer,
                         Callbacks callbacks, Time now)
    : context_(context),
      peerFingerprint_(peer.fingerprint),
      sctp_(peer.sctp),
      callbacks_(std::move(callbacks)),
      now_(now),
      agent_(std::move(local), peer.credentials, peer.addresses, now) {}

void Association::handle(const ice::Address& from, std::span<const std::byte> datagram, Time now) {
  now_ = now;
  if (ice::isStun(datagram)) {
    send(agent_.handle(from, datagram, now));
  } else if (channel_ && path_ == from) {
    agent_.arrived(now);
    channel_->handle(datagram, now);
  }
  begin(now);
}

void Association::advance(Time now) {
  now_ = now;
  send(agent_.advance(now));
  if (channel_) channel_->advance(now);
  if (data_) data_->advance(now);
  begin(now);
}

Association::Time Association::nextTime() const {
  return std::min({agent_.nextTime(), channel_ ? channel_->nextTime() : Time::max(),
                   data_ ? data_->deadline() : Time::max()});
}

void Association::send(std::span<const std::byte> payload, Time now) {
  path_ = agent_.selected(now);
  if (data_)
    static_cast<void>(data_->send(now, payload, false));
  else if (channel_ && !sctp_)
    channel_->send(payload);
}

void Association::close(Time now) {
  path_ = agent_.selected(now);
  if (data_) data_->close("the client ends the association");
  if (channel_) channel_->close();
}

bool Association::isOver(Time now) const {
  return agent_.isOver(now) || (data_ && data_->isClosed()) ||
         (channel_ && (channel_->state() == State::failed || channel_->state() == State::closed));
}

std::string Association::why() const {
  if (!channel_) return "no address of the server answers by UDP";
  if (channel_->state() == State::failed) return "the DTLS handshake failed: " + channel_->error();
  if (channel_->state() == State::handshake) return "the DTLS handshake is not complete";
  if (sctp_ && !hasOpened_) return "the data channel is not open";
  return "the server has ended them";
}

void Association::send(const std::vector<ice::Datagram>& datagrams) const {
  for (const ice::Datagram& datagram : datagrams) callbacks_.send(datagram.to, datagram.bytes);
}

void Association::begin(Time now) {
  path_ = agent_.selected(now);
  if (!channel_ && path_)
    channel_.emplace(context_, dtls::Role::client, peerFingerprint_,
                     dtls::DtlsChannel::Callbacks{.send =
                                                      [this](std::span<const std::byte> datagram) {
                                                        if (path_) callbacks_.send(*path_, datagram);
                                                      },
                                                  .receive =
                                                      [this](std::span<const std::byte> payload) {
                                                        if (data_)
                                                          data_->receive(now_, payload);
                                                        else if (!sctp_)
                                                          callbacks_.receive(payload);
                                                      }},
                     now);
  if (sctp_ && !data_ && channel_ && channel_->state() == State::open) {
    data_.emplace(
        randomChannel(), [this](std::span<const std::byte> packet) { channel_->send(packet); },
        callbacks_.receive);
    data_->connect(now);
  }
  hasOpened_ |= isOpen();
}

bool Association::isOpen() const {
  return channel_ && channel_->state() == State::open && (!sctp_ || (data_ && data_->isOpen()));
}

}  // namespace clothstream
