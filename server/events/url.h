// SPDX-License-Identifier: MIT
// Address of a webhook.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::events {

struct Url {
  bool encrypted = false;
  std::string host;    // name or address, without brackets
  std::string port;    // in digits
  std::string target;  // path and query
  // Host and port as the header `host` has them.
  std::string authority;
};

// Parses http://HOST[:PORT][/PATH][?QUERY], or the same with https. Returns what is wrong with it otherwise.
tl::expected<Url, std::string> parseUrl(std::string_view text);

}  // namespace clothstream::events
