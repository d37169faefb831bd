// SPDX-License-Identifier: MIT
// Names under which browsers may reach the endpoint.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace clothstream::endpoint {

// Protects against DNS rebinding: a foreign page whose name is changed to resolve to this server's address
// would have the same origin as the server's own page. Browsers send the name in the Host field.
class HostNames {
 public:
  // `publicNames` are allowed in addition to every IP address, "localhost", and the name of this machine with
  // and without ".local". "*" allows every name.
  explicit HostNames(std::vector<std::string> publicNames);

  // Returns whether a Host field, with or without a port, names this server. An empty field, which no browser
  // sends, is accepted.
  bool contains(std::string_view host) const;

 private:
  std::vector<std::string> names_;  // in lower case
};

}  // namespace clothstream::endpoint
