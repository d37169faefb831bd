// SPDX-License-Identifier: MIT
// Announces a server by mDNS, so that clients in the same network find it without its address.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace clothstream::discovery {

struct AnnouncedServer {
  std::uint16_t pagePort = 0, grpcPort = 0;
  bool encrypted = false;
  std::string fingerprint;  // of a self-signed certificate; empty: none
  std::string version;      // program and version
};

// Announces the server as "ClothStream on HOST" through the Avahi daemon while it lives. If the daemon starts
// later or restarts, the server is announced then. If that name is taken, Avahi's next alternative is used.
// Has a thread of Avahi; failures are logged and never thrown.
class Announcement {
 public:
  explicit Announcement(AnnouncedServer server);
  ~Announcement();
  Announcement(const Announcement&) = delete;
  Announcement& operator=(const Announcement&) = delete;

 private:
  class Avahi;
  std::unique_ptr<Avahi> avahi_;
};

}  // namespace clothstream::discovery
