// SPDX-License-Identifier: MIT
// Reads the options and the address of the C interface.
#pragma once

#include <string>

#include <clothstream/clothstream.h>
#include <tl/expected.hpp>

#include "clients/native/address.h"

namespace clothstream {

// Returns a copy of `options`, or what is wrong. nullptr means the defaults.
[[nodiscard]] tl::expected<clothstream_options, std::string> readOptions(const clothstream_options* options);

// Address, trust and token of the server, or what is wrong. `address` may be nullptr. `pairs`: a pairing code
// is sent. Codes and tokens go to other machines only with TLS.
[[nodiscard]] tl::expected<ServerAddress, std::string> readAddress(const char* address,
                                                                   const clothstream_options& options,
                                                                   bool pairs);

}  // namespace clothstream
