// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/secure_path.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include <unistd.h>

#include "proto/dtls/digest.h"
#include "proto/dtls/limits.h"

namespace clothstream::endpoint {
namespace {

using dtls::DtlsChannel;

constexpr const char* kLabel = "clothstream";
// Headers of IPv6 and UDP, and of a DTLS record with its nonce and tag (RFC 5288).
constexpr std::uint32_t kLowerHeaders = 40 + 8 + 13 + 8 + 16;
// Common header of SCTP and header of a DATA chunk (RFC 9260, sections 3.1 and 3.3.1).
constexpr std::uint32_t kSctpHeaders = 12 + 16;

// In the form of SDP (dtls::readFingerprint).
std::string sdpFingerprint(const std::string& sha256) {
  dtls::Digest digest{};
  std::memcpy(digest.data(), sha256.data(), std::min(sha256.size(), digest.size()));
  return dtls::fingerprintOf(digest);
}

sctp::Association::Options randomAssociation() {
  std::array<std::uint32_t, 2> random{};
  if (::getentropy(random.data(), sizeof random) != 0)
    throw std::runtime_error("the kernel has no random numbers");
  return {.tag = std::max(random[0], 1u), .firstTsn = random[1]};
}

}  // namespace

SecurePath::SecurePath(const dtls::DtlsContext& context, ice::Credentials local,
                       const messages::DatagramOffer& offer, Callbacks callbacks, Time now)
    : context_(context),
      peerFingerprint_(sdpFingerprint(offer.fingerprint)),
      sctp_(offer.sctp),
      callbacks_(std::move(callbacks)),
      now_(now),
      agent_(std::move(local), {.ufrag = offer.ufrag, .password = offer.password}, now) {}

// Says goodbye to the peer, so that it does not wait for silence.
SecurePath::~SecurePath() {
  if (channel_) channel_->close("the server ends the association");
  if (dtls_) dtls_->close();
}

std::uint32_t SecurePath::headerBytes(bool sctp) {
  return kLowerHeaders + (sctp ? kSctpHeaders : 0);
}

void SecurePath::transmit(std::vector<ice::Datagram> datagrams) const {
  for (const ice::Datagram& datagram : datagrams) callbacks_.transmit(datagram.to, datagram.bytes);
}

bool SecurePath::handleCheck(const Address& from, std::span<const std::byte> datagram, Time now) {
  now_ = now;
  std::vector<ice::Datagram> out = agent_.handle(from, datagram, now);
  const bool authentic = !out.empty();
  transmit(std::move(out));
  if (early_ && agent_.selected(now) == early_->first) {
    const auto [address, records] = *std::exchange(early_, std::nullopt);
    for (const std::vector<std::byte>& record : records) handleRecord(address, record, now);
  }
  return authentic;
}

void SecurePath::handleRecord(const Address& from, std::span<const std::byte> datagram, Time now) {
  now_ = now;
  if (agent_.selected(now) == from) {
    if (begin(from, now)) dtls_->handle(datagram, now);
    if (dtls_ && dtls_->state() != DtlsChannel::State::handshake) handshake_.reset();
  } else if (!dtls_ && datagram.size() <= dtls::kMaxDatagramBytes) {
    if (!early_ || early_->first != from) early_.emplace(from, std::vector<std::vector<std::byte>>());
    auto& records = early_->second;
    if (records.size() == kMaxEarly) records.erase(records.begin());
    records.emplace_back(datagram.begin(), datagram.end());
  }
}

bool SecurePath::begin(const Address& from, Time now) {
  if (dtls_) return true;
  handshake_ = callbacks_.admit(from);
  if (!handshake_) return false;
  std::unique_ptr<sctp::DataChannel> channel;
  if (sctp_)
    channel = std::make_unique<sctp::DataChannel>(
        sctp::DataChannel::Options{.label = kLabel, .association = randomAssociation()},
        [this](std::span<const std::byte> packet) { dtls_->send(packet); }, callbacks_.deliver);
  dtls_ = std::make_unique<DtlsChannel>(
      context_, dtls::Role::server, peerFingerprint_,
      DtlsChannel::Callbacks{.send =
                                 [this](std::span<const std::byte> datagram) {
                                   if (const auto to = agent_.selected(now_))
                                     callbacks_.transmit(*to, datagram);
                                 },
                             .receive = [this](std::span<const std::byte> payload) { receive(payload); }},
      now);
  channel_ = std::move(channel);  // needs dtls_
  return true;
}

void SecurePath::receive(std::span<const std::byte> payload) {
  if (channel_)
    channel_->receive(now_, payload);
  else
    callbacks_.deliver(payload);
}

void SecurePath::send(std::span<const std::byte> payload, bool last, Time now) {
  now_ = now;
  if (channel_)
    static_cast<void>(channel_->send(now, payload, last));
  else if (dtls_)
    dtls_->send(payload);
}

void SecurePath::advance(Time now) {
  now_ = now;
  transmit(agent_.advance(now));
  if (dtls_) dtls_->advance(now);
  if (dtls_ && dtls_->state() != DtlsChannel::State::handshake) handshake_.reset();
  if (channel_ && dtls_->state() == DtlsChannel::State::open) channel_->advance(now);
}

Time SecurePath::nextTime() const {
  Time next = agent_.nextTime();
  if (dtls_) next = std::min(next, dtls_->nextTime());
  if (channel_ && dtls_->state() == DtlsChannel::State::open) next = std::min(next, channel_->deadline());
  return next;
}

bool SecurePath::isOpen() const {
  return dtls_ && dtls_->state() == DtlsChannel::State::open && (!channel_ || channel_->isOpen());
}

bool SecurePath::isOver(Time now) const {
  return agent_.isOver(now) || (channel_ && channel_->isClosed()) ||
         (dtls_ &&
          (dtls_->state() == DtlsChannel::State::closed || dtls_->state() == DtlsChannel::State::failed));
}

std::string SecurePath::endReason() const {
  if (dtls_ && dtls_->state() == DtlsChannel::State::failed) return dtls_->error();
  if (dtls_ && dtls_->state() == DtlsChannel::State::closed) return "the peer has closed it";
  if (channel_ && channel_->isClosed()) return std::string(channel_->closeReason());
  return "no check of the peer has come";
}

}  // namespace clothstream::endpoint
