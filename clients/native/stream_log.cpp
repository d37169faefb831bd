// SPDX-License-Identifier: MIT
#include "clients/native/stream_log.h"

#include <utility>

#include "proto/text/printable.h"

namespace clothstream {

template <typename... Parts>
void StreamLog::say(LogLevel level, const Parts&... parts) {
  if (!onLog_) return;
  std::string text;
  ((text += parts), ...);
  // Names and texts come from the server.
  onLog_(level, printable(text));
}

void StreamLog::received(cs_client* client, std::uint32_t events) {
  const auto happened = [&](std::uint32_t bit) { return (events & bit) != 0; };
  if (happened(CS_EVENT_DESCRIPTION) && !std::exchange(joined_, true))
    say(LogLevel::info, "joined the scene ", cs_scene_name(client), " of ", cs_server_name(client), " at ",
        address_, " as participant ", std::to_string(cs_participant_id(client)));
  if (happened(CS_EVENT_RETURNED))
    say(LogLevel::info, "reconnected as ", cs_resumed(client) != 0 ? "the same" : "a new", " participant");
  if (happened(CS_EVENT_NOTICE)) say(LogLevel::info, "notice from the server: ", cs_notice_text(client));
  if (happened(CS_EVENT_ERROR) && cs_get_state(client) != CS_STATE_FAILED)
    say(LogLevel::warning, "error from the server: ", cs_error_text(client));
}

void StreamLog::lost(const Failure& why) {
  say(LogLevel::warning, why.text);
}

void StreamLog::redirected(const std::string& address) {
  address_ = address;
  say(LogLevel::info, "the scene is at another server: connecting to ", address);
}

void StreamLog::nextAttempt(std::chrono::microseconds in) {
  say(LogLevel::info, "reconnecting in ",
      std::to_string(std::chrono::ceil<std::chrono::milliseconds>(in).count()), " ms");
}

void StreamLog::ended(const Failure& why, bool left) {
  if (!left) return say(LogLevel::error, why.text);
  if (joined_) say(LogLevel::info, "left the scene");
}

}  // namespace clothstream
