// SPDX-License-Identifier: MIT
// The associations of an endpoint: finds the one that a datagram belongs to, and runs what is due.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/endpoint/datagram/association.h"

namespace clothstream::endpoint {

// Addresses of both ends of a datagram. `local` is the server's, without a port; unspecified: the kernel
// chooses it.
struct Route {
  Address peer;
  std::array<std::uint8_t, 16> local{};
  friend bool operator==(const Route&, const Route&) = default;
};

// A check finds its association by the user name, and everything else by the address that it comes from: the
// one that an association has proven, or those that authentic checks came from. So a stranger costs one
// look-up, or the reading of one STUN message.
//
// Not thread-safe. Reads no clock.
class AssociationTable {
 public:
  // Handshakes that are under way at a time, in all and with one address (addressKey). Each takes at most
  // 144 kB of memory. Programs of this machine share one address and have no limit of their own.
  static constexpr std::size_t kMaxHandshakes = 256, kMaxHandshakesOfAddress = 16;

  using Transmit = std::function<void(const Route& route, std::span<const std::byte> datagram)>;
  // `context` and what it names must outlive the table.
  AssociationTable(const AssociationContext& context, Transmit transmit);
  AssociationTable(const AssociationTable&) = delete;
  AssociationTable& operator=(const AssociationTable&) = delete;

  // `local`: new credentials of the server, whose fragment names the association. `wake` is called, from any
  // thread, when the peer's outlet has something: wake() must follow.
  void add(ice::Credentials local, hosting::DatagramPeer peer, std::function<void()> wake, Time now);
  // Does nothing if there is no such association.
  void remove(const std::string& ufrag);
  void clear();
  // Handles a datagram of any bytes.
  void handle(const Route& route, std::span<const std::byte> datagram, Time now);
  // The outlet of this association's peer has something.
  void wake(const std::string& ufrag, Time now);
  // Does what is due. Call it at nextTime().
  void advance(Time now);
  // Time::max() without associations.
  Time nextTime() const { return due_.empty() ? Time::max() : due_.begin()->first; }

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::unique_ptr<Association> association;
    std::optional<Route> proven, checked;  // newest of each kind
    Time due = Time::max();
  };
  // Number of handshakes, shared with their permits.
  struct Handshakes {
    std::size_t all = 0;
    std::map<std::string, std::size_t> ofAddress;
  };
  struct Hash {
    std::size_t operator()(const Address& address) const;
  };

  // Does the step. Ends the association if it throws, because OpenSSL or the kernel fails.
  template <typename Step>
  void attempt(Entry& entry, Step step);
  Entry* findByName(std::span<const std::byte> datagram);
  void handle(Entry& entry, const Route& route, std::span<const std::byte> datagram, Time now);
  // Lets the association do what is due, and notes when that is next.
  void advance(Entry& entry, Time now);
  void setDue(Entry& entry, Time due);
  void forget(Entry& entry, std::optional<Route> Entry::*route);
  void transmit(const Entry& entry, const Address& to, std::span<const std::byte> datagram) const;
  std::shared_ptr<const void> admit(const Address& from);

  const AssociationContext context_;
  const Transmit transmit_;
  const std::shared_ptr<Handshakes> handshakes_ = std::make_shared<Handshakes>();
  // Route of the datagram that an association handles. Its answers take the same way back.
  std::optional<Route> current_;
  std::unordered_map<std::string, Entry> entries_;  // by the server's fragment
  std::unordered_map<Address, Entry*, Hash> proven_;
  std::unordered_multimap<Address, Entry*, Hash> checked_;
  std::set<std::pair<Time, Entry*>> due_;
};

}  // namespace clothstream::endpoint
