// SPDX-License-Identifier: MIT
// Addresses of servers, as users write them.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream {

inline constexpr std::string_view kDefaultAddress = "127.0.0.1:50051";

// Accepts "host", "host:port", "[v6]", "[v6]:port" or a bare v6 address. The default port is 50051.
// The error names the mistake and the allowed form.
[[nodiscard]] tl::expected<std::string, std::string> completeAddress(std::string_view text);

}  // namespace clothstream
