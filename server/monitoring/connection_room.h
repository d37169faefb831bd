// SPDX-License-Identifier: MIT
// Which connection ends when there are too many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace clothstream::monitoring {

// Connections in the order of their arrival. A new one always has room: when there are kMaxConnections, the
// oldest one of the address with the most connections makes place for it. So whoever holds connections open
// delays neither the probes nor the scrapes of others. Not thread-safe.
template <class Connection>
class ConnectionRoom {
 public:
  static constexpr std::size_t kMaxConnections = 16;

  // Returns the connection that must end, which is removed already, or null.
  Connection* add(Connection& connection, std::string address) {
    Connection* const ended = entries_.size() < kMaxConnections ? nullptr : takeCrowded();
    entries_.push_back({&connection, std::move(address)});
    return ended;
  }
  // Does nothing for a connection that is removed already.
  void remove(const Connection& connection) {
    std::erase_if(entries_, [&](const Entry& entry) { return entry.connection == &connection; });
  }

 private:
  struct Entry {
    Connection* connection;
    std::string address;
  };

  Connection* takeCrowded() {
    const auto countOf = [&](const Entry& entry) {
      return std::ranges::count(entries_, entry.address, &Entry::address);
    };
    // The first of equals, which is the oldest.
    const auto found = std::ranges::max_element(entries_, {}, countOf);
    Connection* const connection = found->connection;
    entries_.erase(found);
    return connection;
  }

  std::vector<Entry> entries_;
};

}  // namespace clothstream::monitoring
