// SPDX-License-Identifier: MIT
// Where a server answers, as people write it.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream {

inline constexpr std::string_view kDefaultAddress = "127.0.0.1:50051";

// "host", "host:port", "[v6]", "[v6]:port" or a bare v6 address, completed with port 50051. The error says
// what is wrong and what is allowed.
[[nodiscard]] tl::expected<std::string, std::string> completeAddress(std::string_view text);

}  // namespace clothstream
