// SPDX-License-Identifier: MIT
// The independent implementation usrsctp as the peer of an association, in simulated time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "proto/sctp/sent_tsns.h"

struct socket;  // of usrsctp

namespace clothstream::sctp {

// usrsctp counts time for the whole process, so one peer exists at a time. Thread-safe where usrsctp is not:
// nothing runs but the calling thread.
class UsrsctpPeer {
 public:
  enum class Role { connects, listens };
  struct Received {
    std::uint16_t stream = 0;
    std::uint32_t protocol = 0;
    std::string payload;
  };

  UsrsctpPeer(Role role, Time now, std::function<void(std::span<const std::byte>)> transmit);
  ~UsrsctpPeer();
  UsrsctpPeer(const UsrsctpPeer&) = delete;
  UsrsctpPeer& operator=(const UsrsctpPeer&) = delete;

  void start();  // the connecting role sends its INIT
  void receive(Time now, std::span<const std::byte> packet);
  void advance(Time now);
  Time deadline() const;

  // Sends as browsers do: control messages are ordered and reliable, others neither. Returns false if usrsctp
  // takes no more.
  bool send(std::uint16_t stream, std::uint32_t protocol, const std::string& payload);
  bool resetStream(std::uint16_t stream);
  void shutdown();
  bool isUp() const { return up_; }
  bool hasEnded() const { return ended_; }

  std::vector<Received> received;
  std::vector<std::uint16_t> resetStreams;  // that the other side has reset
  std::size_t reportedErrors = 0;           // ERROR chunks of the other side

 private:
  using Socket = struct ::socket;

  void open();
  void notified(std::span<const std::byte> notification);
  void configure(Socket* socket);

  const Role role_;
  const std::function<void(std::span<const std::byte>)> transmit_;
  Time now_;
  Socket* socket_ = nullptr;
  Socket* listener_ = nullptr;
  bool up_ = false, ended_ = false;
};

}  // namespace clothstream::sctp
