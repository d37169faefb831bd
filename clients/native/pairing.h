// SPDX-License-Identifier: MIT
// Pairs with a server over any transport, without joining a scene.
#pragma once

#include <chrono>
#include <string>

#include <tl/expected.hpp>

#include "clients/native/address.h"
#include "clients/native/failure.h"
#include "clients/native/transport.h"

namespace clothstream {

// Returns the token that the server at the other end of `transport` gives for a pairing code, which must not
// be empty. The transport must not have connected yet. `address` is for texts.
[[nodiscard]] tl::expected<std::string, Failure> pairOver(Transport& transport, const ServerAddress& address,
                                                          const std::string& code,
                                                          std::chrono::milliseconds timeout);

}  // namespace clothstream
