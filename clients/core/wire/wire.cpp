// SPDX-License-Identifier: MIT
// Reads packed varints.
#include "clients/core/wire/wire.h"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace clothstream::client {

bool readPackedVarints(Bytes packed, std::size_t max, std::vector<std::uint32_t>& out) {
  MessageCursor cursor({packed.data(), packed.size()});
  while (!cursor.atEnd()) {
    const std::optional<std::uint64_t> value = cursor.varintValue();
    if (!value || out.size() == max) return false;
    out.push_back(static_cast<std::uint32_t>(*value));
  }
  return true;
}

}  // namespace clothstream::client
