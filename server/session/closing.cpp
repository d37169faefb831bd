// SPDX-License-Identifier: MIT
#include "server/session/closing.h"

#include <utility>

namespace clothstream::session {

Closing closingOf(const delivery::SharedBytes& lastMessage) {
  v1::ServerMessage message;
  if (lastMessage && message.ParseFromArray(lastMessage->data(), static_cast<int>(lastMessage->size()))) {
    if (message.error().fatal()) return {Closing::Reason::error, message.error(), message.error().text()};
    if (message.notice().kind() == v1::NOTICE_KIND_SCENE_DELETED)
      return {Closing::Reason::sceneDeleted, {}, message.notice().text()};
  }
  return {Closing::Reason::serverStopping, {}, "the server is stopping"};
}

}  // namespace clothstream::session
