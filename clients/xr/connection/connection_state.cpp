// SPDX-License-Identifier: MIT
#include "clients/xr/connection/connection_state.h"

#include <algorithm>

namespace clothstream::xr {

Trouble troubleOf(Step step, clothstream_result result, const std::string& text, const std::string& address) {
  switch (result) {
    case CLOTHSTREAM_OK:
      return {};
    case CLOTHSTREAM_INVALID:
      return {"The options are not allowed", text};
    case CLOTHSTREAM_UNREACHABLE:
      return {"The server does not answer",
              "No answer from " + address + ": " + text + " The next attempt follows by itself."};
    case CLOTHSTREAM_REFUSED:
      if (step == Step::pairing)
        return {"The server refused the pairing code",
                text + " Start again with --code and the six digits that the server shows now."};
      if (step == Step::streaming) return {"The server ended the session", text};
      return {"The server refused to let you in", text};
    case CLOTHSTREAM_LOST:
      return {"The connection is lost", text + " The next attempt follows by itself."};
    case CLOTHSTREAM_FAILED:
      break;
  }
  return {"The client failed", text};
}

Trouble lostTrouble(const std::string& address) {
  return {
      "The server is gone",
      "The connection to " + address +
          " is lost. It is opened again as soon as the server answers. The cloth stands still meanwhile."};
}

bool retriesByItself(Step step, clothstream_result result) {
  if (result == CLOTHSTREAM_UNREACHABLE || result == CLOTHSTREAM_FAILED) return true;
  return step == Step::streaming && result == CLOTHSTREAM_LOST;
}

std::uint64_t retryDelayUs(std::uint32_t failures) {
  constexpr std::uint64_t kSecond = 1'000'000;
  return kSecond << std::min(failures > 0 ? failures - 1 : 0, 3U);
}

}  // namespace clothstream::xr
