// SPDX-License-Identifier: MIT
// A connection to either endpoint of a server. Many connections share few threads.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "clients/native/address.h"

namespace clothstream::load {

// Receives the events of a link. A thread of the Links makes one call at a time; closed() is the last.
class LinkListener {
 public:
  // One message after a call of Link::read(). The bytes are valid only during the call.
  virtual void received(std::span<const std::byte> message) = 0;
  // `why` is the reason from the server or the network.
  virtual void closed(const std::string& why) = 0;

 protected:
  ~LinkListener() = default;
};

// Thread-safe.
class Link {
 public:
  virtual ~Link() = default;
  // Requests one more message. Call it once at first and once after each received(); fewer calls make a slow
  // reader.
  virtual void read() = 0;
  // Queues a message. Messages are sent in order once the link is open.
  virtual void send(std::string message) = 0;
  // Says goodbye. closed() follows when the server has closed the link.
  virtual void leave() = 0;
  // Disconnects without a goodbye. Must be the last call. After it returns, the listener is not called any
  // more.
  virtual void drop() = 0;
};

class Links {
 public:
  virtual ~Links() = default;
  // Starts to connect. The listener must outlive the link; the link must not outlive the Links.
  virtual std::unique_ptr<Link> open(LinkListener& listener) = 0;
};

// `address` is from completeAddress(), or HOST:PORT.
std::unique_ptr<Links> makeGrpcLinks(const ServerAddress& address);
std::unique_ptr<Links> makeWebLinks(const ServerAddress& address);

}  // namespace clothstream::load
