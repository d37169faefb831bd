// SPDX-License-Identifier: MIT
#include "server/endpoint/web/host_names.h"

#include <algorithm>
#include <utility>

#include <boost/algorithm/string/case_conv.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/host_name.hpp>

namespace clothstream::endpoint {
namespace {

// The name or address of a Host field, without its port, brackets and final dot.
std::string_view nameOf(std::string_view host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') - 1);
  host = host.substr(0, host.find(':'));
  if (host.ends_with('.')) host.remove_suffix(1);
  return host;
}

}  // namespace

HostNames::HostNames(std::vector<std::string> publicNames) : names_(std::move(publicNames)) {
  boost::system::error_code unknown;
  const std::string machine = boost::asio::ip::host_name(unknown);
  names_.insert(names_.end(), {"localhost", machine, machine + ".local"});
  for (std::string& name : names_) boost::algorithm::to_lower(name);
}

bool HostNames::contains(std::string_view host) const {
  if (host.empty()) return true;
  const std::string name = boost::algorithm::to_lower_copy(std::string(nameOf(host)));
  boost::system::error_code notAnAddress;
  boost::asio::ip::make_address(name, notAnAddress);
  return !notAnAddress ||
         std::ranges::any_of(names_, [&](const std::string& known) { return known == "*" || known == name; });
}

}  // namespace clothstream::endpoint
