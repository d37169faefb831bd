// SPDX-License-Identifier: MIT
// Parts of files for error texts.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "proto/text/printable.h"
#include "proto/text/utf8.h"

namespace clothstream {

// Start of a text of any encoding, of about `most` bytes, as printable UTF-8. Bytes that are not UTF-8 and
// characters that must not be shown are written as \xNN. A text that is cut ends with "...".
inline std::string excerpt(std::string_view text, std::size_t most = 60) {
  std::string shown;
  while (!text.empty() && shown.size() < most) {
    const std::size_t bytes = characterBytes(text);
    if (bytes == 0)
      shown += "\\x" + hexDigits(static_cast<unsigned char>(text.front()), 2);
    else
      shown += printable(text.substr(0, bytes));
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return text.empty() ? shown : shown + "...";
}

}  // namespace clothstream
