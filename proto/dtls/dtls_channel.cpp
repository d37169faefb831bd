// SPDX-License-Identifier: MIT
#include "proto/dtls/dtls_channel.h"

#include <algorithm>
#include <array>
#include <utility>

#include <openssl/bio.h>
#include <sys/time.h>

namespace clothstream::dtls {
namespace {

// Headers of IPv4 and UDP, which OpenSSL subtracts from the MTU of a path.
constexpr long kHeadersBelow = 28;

// Microseconds until a flight is repeated, from the last such time; 0 at the start of a flight.
unsigned nextTimeout(SSL*, unsigned last) {
  constexpr unsigned kFirst = 100'000, kLast = 800'000;
  return last == 0 ? kFirst : std::min(2 * last, kLast);
}

// Bytes that the cipher of the association adds to a payload: the tag, with AES-GCM also a nonce (RFC 5288).
std::size_t overheadOf(const SSL& ssl) {
  constexpr std::size_t kTag = 16, kNonce = 8;
  const bool hasNonce = SSL_CIPHER_get_cipher_nid(SSL_get_current_cipher(&ssl)) != NID_chacha20_poly1305;
  return kTag + (hasNonce ? kNonce : 0);
}

}  // namespace

// Gives each record to the channel at once. A memory BIO would join them.
struct DtlsChannel::Bridge {
  static DtlsChannel& channelOf(BIO* bio) { return *static_cast<DtlsChannel*>(BIO_get_data(bio)); }

  static int write(BIO* bio, const char* bytes, int size) {
    DtlsChannel& channel = channelOf(bio);
    const std::span datagram(reinterpret_cast<const std::byte*>(bytes), static_cast<std::size_t>(size));
    ++channel.statistics_.datagramsSent;
    channel.statistics_.bytesSent += datagram.size();
    channel.callbacks_.send(datagram);
    return size;
  }

  static int read(BIO* bio, char* bytes, int room) {
    std::span<const std::byte>& incoming = channelOf(bio).incoming_;
    BIO_clear_retry_flags(bio);
    if (incoming.empty()) {
      BIO_set_retry_read(bio);
      return -1;
    }
    const std::size_t size = std::min(incoming.size(), static_cast<std::size_t>(room));
    std::ranges::copy(incoming.first(size), reinterpret_cast<std::byte*>(bytes));
    incoming = {};
    return static_cast<int>(size);
  }

  static long control(BIO*, int command, long, void*) {
    switch (command) {
      case BIO_CTRL_FLUSH:
        return 1;
      case BIO_CTRL_DGRAM_QUERY_MTU:
        return kHandshakeMtu;
      case BIO_CTRL_DGRAM_GET_MTU_OVERHEAD:
        return kHeadersBelow;
      default:
        return 0;
    }
  }

  static const BIO_METHOD* method() {
    static const std::unique_ptr<BIO_METHOD, tls::Freed<BIO_meth_free>> method = [] {
      std::unique_ptr<BIO_METHOD, tls::Freed<BIO_meth_free>> made(
          tls::check(BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "datagrams"), "BIO"));
      tls::check(BIO_meth_set_write(made.get(), &write), "BIO");
      tls::check(BIO_meth_set_read(made.get(), &read), "BIO");
      tls::check(BIO_meth_set_ctrl(made.get(), &control), "BIO");
      return made;
    }();
    return method.get();
  }

  static tls::Bio make(DtlsChannel& channel) {
    tls::Bio bio(tls::check(BIO_new(method()), "BIO"));
    BIO_set_data(bio.get(), &channel);
    BIO_set_init(bio.get(), 1);
    return bio;
  }
};

DtlsChannel::DtlsChannel(const DtlsContext& context, Role role, std::string peerFingerprint,
                         Callbacks callbacks, Time now)
    : peerFingerprint_(std::move(peerFingerprint)),
      callbacks_(std::move(callbacks)),
      begun_(now),
      ssl_(context.newAssociation(peerFingerprint_)) {
  SSL_set_mtu(ssl_.get(), kHandshakeMtu);
  DTLS_set_timer_cb(ssl_.get(), &nextTimeout);
  BIO* const bio = Bridge::make(*this).release();
  SSL_set_bio(ssl_.get(), bio, bio);
  if (role == Role::client)
    SSL_set_connect_state(ssl_.get());
  else
    SSL_set_accept_state(ssl_.get());
  if (role == Role::client) read(now);
}

void DtlsChannel::handle(std::span<const std::byte> datagram, Time now) {
  if (state_ != State::handshake && state_ != State::open) return;
  ++statistics_.datagramsReceived;
  statistics_.bytesReceived += datagram.size();
  if (!admits(datagram)) {
    ++statistics_.dropped;
    return;
  }
  incoming_ = datagram;
  read(now);
  incoming_ = {};
}

// Returns whether OpenSSL may read the datagram.
bool DtlsChannel::admits(std::span<const std::byte> datagram) {
  if (datagram.empty() || datagram.size() > kMaxDatagramBytes) return false;
  if (state_ == State::open) return hasWholeRecords(datagram, leastEncrypted_);
  const bool admitted = guard_.admits(datagram);
  if (guard_.isExhausted()) fail("the peer has sent more than a DTLS handshake needs");
  return admitted;
}

// Lets OpenSSL read the datagram, and write what the handshake needs.
void DtlsChannel::read(Time now) {
  std::array<std::byte, kMaxDatagramBytes> payload;
  for (bool more = true; more && (state_ == State::handshake || state_ == State::open);) {
    ERR_clear_error();  // other channels of this thread share its queue
    const int size = SSL_read(ssl_.get(), payload.data(), static_cast<int>(payload.size()));
    const int reason = SSL_get_error(ssl_.get(), size);
    if (state_ == State::handshake && reason != SSL_ERROR_SSL && SSL_is_init_finished(ssl_.get())) {
      state_ = State::open;
      leastEncrypted_ = overheadOf(*ssl_);
      statistics_.handshake = now - begun_;
    }
    more = size > 0;
    if (more) {
      ++statistics_.payloads;
      callbacks_.receive(std::span(payload).first(static_cast<std::size_t>(size)));
    } else if (reason != SSL_ERROR_WANT_READ) {
      end(reason);
    }
  }
  readTimer(now);
}

void DtlsChannel::readTimer(Time now) {
  timeval left{};
  timer_ = state_ == State::handshake && DTLSv1_get_timeout(ssl_.get(), &left) == 1
               ? now + std::chrono::seconds(left.tv_sec) + std::chrono::microseconds(left.tv_usec)
               : Time::max();
}

bool DtlsChannel::send(std::span<const std::byte> payload) {
  if (state_ != State::open || payload.empty() || payload.size() > kMaxPayloadBytes) return false;
  ERR_clear_error();
  const int size = SSL_write(ssl_.get(), payload.data(), static_cast<int>(payload.size()));
  if (size > 0) return true;
  end(SSL_get_error(ssl_.get(), size));
  return false;
}

void DtlsChannel::advance(Time now) {
  if (state_ != State::handshake) return;
  if (now - begun_ >= kHandshakeLimit) return fail("the DTLS handshake took longer than 8 s");
  if (now < timer_) return;
  ERR_clear_error();
  const long result = DTLSv1_handle_timeout(ssl_.get());
  if (result < 0) return end(SSL_get_error(ssl_.get(), static_cast<int>(result)));
  if (result > 0) ++statistics_.repeatedFlights;
  readTimer(now);
}

Time DtlsChannel::nextTime() const {
  return state_ == State::handshake ? std::min(timer_, begun_ + kHandshakeLimit) : Time::max();
}

void DtlsChannel::close() {
  if (state_ != State::handshake && state_ != State::open) return;
  const bool open = state_ == State::open;
  state_ = State::closed;
  if (!open) return;  // there are no keys for a close_notify
  ERR_clear_error();
  SSL_shutdown(ssl_.get());
}

void DtlsChannel::end(int reason) {
  if (reason == SSL_ERROR_ZERO_RETURN) return close();
  if (SSL_get_verify_result(ssl_.get()) == X509_V_ERR_CERT_REJECTED)
    return fail("the peer's certificate does not have the fingerprint " + peerFingerprint_);
  fail((state_ == State::handshake ? "DTLS handshake: " : "DTLS: ") +
       (ERR_peek_error() == 0 ? "a record is malformed" : tls::opensslError()));
}

void DtlsChannel::fail(std::string error) {
  state_ = State::failed;
  error_ = std::move(error);
}

}  // namespace clothstream::dtls
