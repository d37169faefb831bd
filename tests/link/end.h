// SPDX-License-Identifier: MIT
// One end of the link: a network namespace with one TUN device.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/link/descriptor.h"

namespace clothstream::link {

// The machine does not permit namespaces or TUN devices.
struct NotPermitted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct EndOptions {
  std::uint32_t number = 1;  // last part of the addresses, 1 to 9
  std::uint32_t mtu = 1500;  // bytes of the largest IP packet; at least 1280 (RFC 8200, section 5)
  std::string congestion;    // algorithm of TCP; empty: the kernel's default
};

// A child process makes a user namespace and a network namespace in it, and has no rights over the network of
// the machine. The namespaces exist until this object, or this process, and all programs in them have ended.
class End {
 public:
  // Throws NotPermitted, or std::runtime_error for other reasons.
  explicit End(const EndOptions& options);
  ~End();
  End(const End&) = delete;
  End& operator=(const End&) = delete;

  // Process in the namespaces, for `nsenter --user --net --target`.
  pid_t pid() const { return pid_; }
  // The IPv4 address and, unless the kernel has no IPv6, the IPv6 address.
  const std::vector<std::string>& addresses() const { return addresses_; }
  // TUN device: a read returns one IP packet, a write takes one. Does not block.
  int device() const { return *device_; }
  // Packets that the kernel has dropped because they were not read in time.
  std::uint64_t overflowed() const;

 private:
  pid_t pid_ = -1;
  std::vector<std::string> addresses_;
  Descriptor device_;
  Descriptor lifeline_;  // the child ends when this is closed
};

}  // namespace clothstream::link
