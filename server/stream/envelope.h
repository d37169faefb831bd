// SPDX-License-Identifier: MIT
// Serialised ServerMessages, made once and shared by all who get them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"

namespace clothstream::stream {

// A serialised ServerMessage.
using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

SharedBytes serialise(const v1::ServerMessage& message);

// `participant`: who did it; 0: the server, or somebody who is not in the scene.
SharedBytes notice(v1::NoticeKind kind, std::string text, std::uint64_t tick, std::uint64_t participant = 0);

// `participant` as above.
SharedBytes parametersChanged(v1::ParameterChange change, std::uint64_t tick, std::uint64_t participant = 0);

// `requestId` is that of the message which is answered.
SharedBytes error(v1::ErrorCode code, std::string text, bool fatal, std::uint64_t requestId = 0);

// The last word to a peer that does not read what it is sent: it may come back.
SharedBytes tooSlow();

}  // namespace clothstream::stream
