// SPDX-License-Identifier: MIT
#include "tests/sctp/usrsctp_peer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <sys/time.h>
#include <usrsctp.h>

#include "proto/sctp/chunks.h"

namespace {

clothstream::sctp::Time usrsctpTime{};

}  // namespace

// Some timers of usrsctp compare times of this clock, which must be simulated, too.
extern "C" int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  const auto since = usrsctpTime.time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since);
  time->tv_sec = seconds.count();
  time->tv_usec = std::chrono::duration_cast<std::chrono::microseconds>(since - seconds).count();
  return 0;
}

namespace clothstream::sctp {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(10);  // of usrsctp's timers
constexpr std::uint32_t kReliable = 50;                    // payload protocol identifier of DCEP

using Socket = struct ::socket;

void demand(bool holds, const char* call) {
  if (!holds) throw std::runtime_error(std::string("usrsctp fails in ") + call);
}

template <typename T>
void set(Socket* socket, int option, const T& value) {
  demand(usrsctp_setsockopt(socket, IPPROTO_SCTP, option, &value, sizeof value) == 0, "setsockopt");
}

sockaddr_conn addressOf(void* self) {
  sockaddr_conn address{};
  address.sconn_family = AF_CONN;
  address.sconn_port = htons(kPort);
  address.sconn_addr = self;
  return address;
}

template <typename Event>
Event copyOf(std::span<const std::byte> bytes) {
  Event event{};
  std::memcpy(&event, bytes.data(), std::min(sizeof event, bytes.size()));
  return event;
}

}  // namespace

UsrsctpPeer::UsrsctpPeer(Role role, Time now, std::function<void(std::span<const std::byte>)> transmit)
    : role_(role), transmit_(std::move(transmit)), now_(now) {
  usrsctpTime = now;
  usrsctp_init_nothreads(
      0,
      [](void* self, void* packet, std::size_t size, std::uint8_t, std::uint8_t) {
        static_cast<UsrsctpPeer*>(self)->transmit_({static_cast<const std::byte*>(packet), size});
        return 0;
      },
      nullptr);
  usrsctp_sysctl_set_sctp_ecn_enable(0);
  usrsctp_sysctl_set_sctp_asconf_enable(0);
  usrsctp_sysctl_set_sctp_auth_enable(0);
  usrsctp_register_address(this);
  open();
}

UsrsctpPeer::~UsrsctpPeer() {
  if (socket_) usrsctp_close(socket_);
  if (listener_) usrsctp_close(listener_);
  usrsctp_deregister_address(this);
  usrsctp_handle_timers(10'000);
  for (int i = 0; i < 1000 && usrsctp_finish() != 0; ++i) usrsctp_handle_timers(1000);
}

void UsrsctpPeer::open() {
  const auto receive = [](Socket*, sctp_sockstore, void* data, std::size_t size, sctp_rcvinfo info, int flags,
                          void* self) {
    if (data == nullptr) return 1;
    auto& peer = *static_cast<UsrsctpPeer*>(self);
    const std::span<const std::byte> bytes(static_cast<const std::byte*>(data), size);
    if ((flags & MSG_NOTIFICATION) != 0) {
      peer.notified(bytes);
    } else {
      peer.received.push_back({info.rcv_sid, ntohl(info.rcv_ppid), {static_cast<const char*>(data), size}});
    }
    std::free(data);
    return 1;
  };
  socket_ = usrsctp_socket(AF_CONN, SOCK_STREAM, IPPROTO_SCTP, receive, nullptr, 0, this);
  demand(socket_ != nullptr, "socket");
  configure(socket_);
  sockaddr_conn address = addressOf(this);
  demand(usrsctp_bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0, "bind");
  if (role_ == Role::connects) return;
  demand(usrsctp_listen(socket_, 1) == 0, "listen");
  listener_ = std::exchange(socket_, nullptr);
}

void UsrsctpPeer::configure(Socket* socket) {
  usrsctp_set_non_blocking(socket, 1);
  const linger abortive{1, 0};
  usrsctp_setsockopt(socket, SOL_SOCKET, SO_LINGER, &abortive, sizeof abortive);
  const int on = 1;
  set(socket, SCTP_NODELAY, on);
  sctp_assoc_value resets{};
  resets.assoc_id = SCTP_ALL_ASSOC;
  resets.assoc_value = SCTP_ENABLE_RESET_STREAM_REQ;
  set(socket, SCTP_ENABLE_STREAM_RESET, resets);
  for (const int type : {SCTP_ASSOC_CHANGE, SCTP_REMOTE_ERROR, SCTP_STREAM_RESET_EVENT}) {
    sctp_event event{};
    event.se_assoc_id = SCTP_ALL_ASSOC;
    event.se_type = static_cast<std::uint16_t>(type);
    event.se_on = 1;
    set(socket, SCTP_EVENT, event);
  }
}

void UsrsctpPeer::start() {
  if (role_ == Role::listens) return;
  sockaddr_conn address = addressOf(this);
  demand(usrsctp_connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 ||
             errno == EINPROGRESS,
         "connect");
}

void UsrsctpPeer::receive(Time now, std::span<const std::byte> packet) {
  advance(now);
  usrsctp_conninput(this, packet.data(), packet.size(), 0);
  if (listener_ == nullptr || socket_ != nullptr) return;
  socket_ = usrsctp_accept(listener_, nullptr, nullptr);
  if (socket_) configure(socket_);
}

void UsrsctpPeer::advance(Time now) {
  for (; now_ + kTick <= now; now_ += kTick) {
    usrsctpTime = now_ + kTick;
    usrsctp_handle_timers(kTick / std::chrono::milliseconds(1));
  }
  usrsctpTime = now;
}

Time UsrsctpPeer::deadline() const {
  return now_ + kTick;
}

bool UsrsctpPeer::send(std::uint16_t stream, std::uint32_t protocol, const std::string& payload) {
  sctp_sendv_spa options{};
  options.sendv_flags = SCTP_SEND_SNDINFO_VALID;
  options.sendv_sndinfo.snd_sid = stream;
  options.sendv_sndinfo.snd_ppid = htonl(protocol);
  if (protocol != kReliable) {
    options.sendv_flags |= SCTP_SEND_PRINFO_VALID;
    options.sendv_sndinfo.snd_flags = SCTP_UNORDERED;
    options.sendv_prinfo.pr_policy = SCTP_PR_SCTP_RTX;
    options.sendv_prinfo.pr_value = 0;
  }
  return usrsctp_sendv(socket_, payload.data(), payload.size(), nullptr, 0, &options, sizeof options,
                       SCTP_SENDV_SPA, 0) >= 0;
}

bool UsrsctpPeer::resetStream(std::uint16_t stream) {
  std::array<std::byte, sizeof(sctp_reset_streams) + sizeof stream> bytes{};
  sctp_reset_streams request{};
  request.srs_flags = SCTP_STREAM_RESET_OUTGOING;
  request.srs_number_streams = 1;
  std::memcpy(bytes.data(), &request, sizeof request);
  std::memcpy(bytes.data() + sizeof request, &stream, sizeof stream);
  return usrsctp_setsockopt(socket_, IPPROTO_SCTP, SCTP_RESET_STREAMS, bytes.data(), bytes.size()) == 0;
}

void UsrsctpPeer::shutdown() {
  usrsctp_shutdown(socket_, SHUT_WR);
}

void UsrsctpPeer::notified(std::span<const std::byte> notification) {
  const auto type = copyOf<std::uint16_t>(notification);
  if (type == SCTP_REMOTE_ERROR) {
    ++reportedErrors;
  } else if (type == SCTP_ASSOC_CHANGE) {
    const auto state = copyOf<sctp_assoc_change>(notification).sac_state;
    up_ |= state == SCTP_COMM_UP;
    ended_ |= state == SCTP_COMM_LOST || state == SCTP_SHUTDOWN_COMP || state == SCTP_CANT_STR_ASSOC;
  } else if (type == SCTP_STREAM_RESET_EVENT) {
    const auto event = copyOf<sctp_stream_reset_event>(notification);
    if ((event.strreset_flags & SCTP_STREAM_RESET_INCOMING_SSN) == 0) return;
    for (std::size_t at = sizeof event; at + 2 <= notification.size(); at += 2)
      resetStreams.push_back(copyOf<std::uint16_t>(notification.subspan(at, 2)));
  }
}

}  // namespace clothstream::sctp
