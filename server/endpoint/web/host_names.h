// SPDX-License-Identifier: MIT
// Names under which browsers may reach the endpoint.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace clothstream::endpoint {

// Protects from DNS rebinding: a page of a foreign name whose address changes to that of this server would be
// of the same origin as the server's own page. Browsers send the name in the Host field.
class HostNames {
 public:
  // `publicNames` are allowed in addition to every IP address, "localhost", and the name of this machine with
  // and without ".local". "*" allows every name.
  explicit HostNames(std::vector<std::string> publicNames);

  // Whether a Host field, with or without a port, names this server. An empty field, which no browser sends,
  // does.
  bool contains(std::string_view host) const;

 private:
  std::vector<std::string> names_;  // in lower case
};

}  // namespace clothstream::endpoint
