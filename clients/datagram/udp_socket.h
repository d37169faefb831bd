// SPDX-License-Identifier: MIT
// UDP sockets, and a thread that receives for them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/ice/address.h"

namespace clothstream {

// An IPv4 or IPv6 address as text, with a port. Nothing if it is malformed.
[[nodiscard]] std::optional<ice::Address> readAddress(const std::string& text, std::uint16_t port);

struct ReceivedDatagram {
  ice::Address from;
  std::vector<std::byte> bytes;
};

// Thread of sockets, which must not outlive it. It starts with the first one. Thread-safe.
class UdpThread {
 public:
  UdpThread();
  ~UdpThread();
  UdpThread(const UdpThread&) = delete;
  UdpThread& operator=(const UdpThread&) = delete;

 private:
  friend class UdpSocket;
  class Impl;
  Impl& started();

  std::once_flag once_;
  std::unique_ptr<Impl> impl_;
};

// Sends to and receives from IPv4 and IPv6, or IPv4 alone where the machine has no IPv6. Keeps at most
// kMaxWaiting datagrams until they are taken; more are lost. Its functions belong to one thread.
class UdpSocket {
 public:
  static constexpr std::size_t kMaxWaiting = 1024, kMaxBytes = 2048;

  // `onArrival` is called on the thread of sockets after each datagram. Throws boost::system::system_error if
  // no socket can be opened.
  UdpSocket(UdpThread& thread, std::function<void()> onArrival);
  // Waits until what was sent before is on its way. onArrival is not called any more, so it must not wait for
  // the caller.
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  std::uint16_t port() const;
  // Sends the datagram, or loses it.
  void send(const ice::Address& to, std::span<const std::byte> datagram);
  // Takes what has arrived.
  std::vector<ReceivedDatagram> take();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace clothstream
