// SPDX-License-Identifier: MIT
#include "server/events/url.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "proto/text/printable.h"

namespace clothstream::events {
namespace {

constexpr std::string_view kPlain = "http://", kEncrypted = "https://";

bool isPort(std::string_view text) {
  std::uint16_t port = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && rest == text.data() + text.size() && port > 0;
}

bool isHost(std::string_view text) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-_";
  return !text.empty() && text.find_first_not_of(kAllowed) == std::string_view::npos;
}

bool isAddressInBrackets(std::string_view text) {
  return text.size() > 2 && text.starts_with('[') && text.ends_with(']') &&
         text.substr(1, text.size() - 2).find_first_not_of("0123456789abcdefABCDEF:.") ==
             std::string_view::npos;
}

}  // namespace

tl::expected<Url, std::string> parseUrl(std::string_view text) {
  const auto refused = [&](std::string_view why) {
    return tl::unexpected(
        fmt::format("'{}' {}; use http://HOST:PORT/PATH or https://HOST/PATH", printable(text), why));
  };
  Url url;
  url.encrypted = text.starts_with(kEncrypted);
  if (!url.encrypted && !text.starts_with(kPlain)) return refused("begins with neither http:// nor https://");
  // Spaces and control characters would end the line of a request.
  if (std::ranges::any_of(text, [](char c) { return c <= ' ' || c > '~'; }))
    return refused("has a character that a URL cannot have");
  if (text.find('#') != std::string_view::npos) return refused("has a fragment (#), which is never sent");
  const std::string_view rest = text.substr(url.encrypted ? kEncrypted.size() : kPlain.size());
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?"));
  if (authority.find('@') != std::string_view::npos)
    return refused("has a user name or a password, which is not sent: the signature identifies the server");
  const std::size_t afterAddress = authority.find(']') == std::string_view::npos ? 0 : authority.find(']');
  const std::size_t colon = authority.find(':', afterAddress);
  const std::string_view host = authority.substr(0, colon);
  if (isAddressInBrackets(host))
    url.host = host.substr(1, host.size() - 2);
  else if (isHost(host))
    url.host = host;
  else
    return refused("has no valid host");
  url.port = url.encrypted ? "443" : "80";
  if (colon != std::string_view::npos) url.port = authority.substr(colon + 1);
  if (!isPort(url.port)) return refused("has a port that is not 1 to 65535");
  url.target = rest.substr(authority.size());
  if (!url.target.starts_with('/')) url.target = "/" + url.target;
  url.authority = authority;
  return url;
}

}  // namespace clothstream::events
