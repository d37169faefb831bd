// SPDX-License-Identifier: MIT
#include "clients/xr/connection/connection_state.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace clothstream::xr {
namespace {

constexpr const char* kAgain = " The next attempt follows by itself.";

std::string sentence(const std::string& text) {
  const bool ends = text.empty() || text.ends_with('.') || text.ends_with('?') || text.ends_with('!');
  return ends ? text : text + '.';
}

// The library names members of its options.
std::string withOptionsOfProgram(std::string text) {
  constexpr std::array<std::array<std::string_view, 2>, 2> kNames{
      {{"options->ca_file", "--ca"}, {"options->fingerprint", "--fingerprint"}}};
  for (const auto& [name, option] : kNames)
    for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos; at += option.size())
      text.replace(at, name.size(), option);
  return text;
}

}  // namespace

Trouble troubleOf(Step step, clothstream_result result, const std::string& text) {
  const std::string reason = sentence(text);
  switch (result) {
    case CLOTHSTREAM_OK:
      return {};
    case CLOTHSTREAM_INVALID:
      return {"The options are not allowed", withOptionsOfProgram(reason)};
    case CLOTHSTREAM_UNREACHABLE:
      return {"The server does not answer", reason + kAgain};
    case CLOTHSTREAM_REFUSED:
      if (step == Step::pairing)
        return {"The server refused the pairing code", reason +
                                                           " Start again with --code and the six digits that "
                                                           "the server shows now, or without --code if it "
                                                           "shows none."};
      if (step == Step::streaming) return {"The server ended the session", reason};
      return {"The server refused to let you in", reason};
    case CLOTHSTREAM_LOST:
      return {"The connection is lost", reason + kAgain};
    case CLOTHSTREAM_FAILED:
      break;
  }
  return {"The client failed", reason + kAgain};
}

Trouble lostTrouble(const std::string& address) {
  return {
      "The server is gone",
      "The connection to " + address +
          " is lost. It is opened again as soon as the server answers. The cloth stands still meanwhile."};
}

bool retriesByItself(clothstream_result result) {
  return result == CLOTHSTREAM_UNREACHABLE || result == CLOTHSTREAM_LOST || result == CLOTHSTREAM_FAILED;
}

std::uint64_t retryDelayUs(std::uint32_t failures) {
  constexpr std::uint64_t kSecond = 1'000'000;
  return kSecond << std::min(failures > 0 ? failures - 1 : 0, 3U);
}

}  // namespace clothstream::xr
