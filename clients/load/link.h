// SPDX-License-Identifier: MIT
// One connection to a server by either of its endpoints, many of which share few threads.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace clothstream::load {

// What a link tells, from a thread of its links, one call at a time; closed() is the last.
class LinkListener {
 public:
  // One message, for which Link::read() asked; the bytes are gone when it returns.
  virtual void received(std::span<const std::byte> message) = 0;
  // The server's reason, or the network's.
  virtual void closed(const std::string& why) = 0;

 protected:
  ~LinkListener() = default;
};

// Thread-safe.
class Link {
 public:
  virtual ~Link() = default;
  // One message more: to be called once for the first, then once after each received(). Who does so seldom is
  // slow.
  virtual void read() = 0;
  // Queued until it is open, and in the order of the calls.
  virtual void send(std::string message) = 0;
  // Says goodbye: closed() follows once the server has heard it.
  virtual void leave() = 0;
  // Without a word, if it is still there; the listener is called no more when it returns. The last call.
  virtual void drop() = 0;
};

class Links {
 public:
  virtual ~Links() = default;
  // Begins to connect. The listener outlives the link, which must not outlive the links.
  virtual std::unique_ptr<Link> open(LinkListener& listener) = 0;
};

// `address` is HOST:PORT.
std::unique_ptr<Links> makeGrpcLinks(const std::string& address);
std::unique_ptr<Links> makeWebLinks(const std::string& address);

}  // namespace clothstream::load
