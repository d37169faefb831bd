// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/caller.h"

#include <string_view>

#include "server/endpoint/listen/address_rate.h"

namespace clothstream::endpoint {

boost::asio::ip::address addressOf(const std::string& peer) {
  const std::size_t scheme = peer.find(':'), port = peer.rfind(':');
  if (scheme == port) return {};
  std::string host = peer.substr(scheme + 1, port - scheme - 1);
  constexpr std::size_t kBracket = 3;  // %5B and %5D
  if (host.starts_with("%5B") && host.size() > 2 * kBracket)
    host = host.substr(kBracket, host.size() - 2 * kBracket);
  if (const std::size_t scope = host.find("%25"); scope != std::string::npos) host.replace(scope, 3, "%");
  boost::system::error_code unknown;  // counts as a separate address
  return boost::asio::ip::make_address(host, unknown);
}

std::string addressKeyOf(const std::string& peer) {
  return addressKey(addressOf(peer));
}

std::string reachedBy(const std::string& peer) {
  const boost::asio::ip::address address = addressOf(peer);
  return addressKey(address).empty() ? plainText(address) : std::string();
}

std::string tokenIn(const grpc::ServerContext& context) {
  constexpr std::string_view kScheme = "Bearer ";
  const auto found = context.client_metadata().find("authorization");
  if (found == context.client_metadata().end()) return {};
  const std::string_view value(found->second.data(), found->second.size());
  return value.starts_with(kScheme) ? std::string(value.substr(kScheme.size())) : std::string();
}

}  // namespace clothstream::endpoint
