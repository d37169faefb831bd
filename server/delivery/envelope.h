// SPDX-License-Identifier: MIT
// Serialised ServerMessages, made once and shared by all receivers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/delivery/wire_types.h"

namespace clothstream::delivery {

// A serialised ServerMessage. Immutable.
using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

SharedBytes serialise(const v1::ServerMessage& message);

// ServerMessage with a frame: the fields of `frame` and this packet. The same bytes as serialise() of the
// whole message, but the packet is copied once and nothing else than the result is allocated.
// `frame.packet` must be empty.
SharedBytes serialiseFrame(const v1::Frame& frame, std::span<const std::byte> packet);

// `participant` caused the notice; 0 means the server or a peer outside the scene.
SharedBytes notice(v1::NoticeKind kind, std::string text, std::uint64_t tick, std::uint64_t participant = 0);

// `participant` as for notice().
SharedBytes parametersChanged(v1::ParameterChange change, std::uint64_t tick, std::uint64_t participant = 0);

// `requestId` is that of the message being answered, `server` the one that has the scene, if it is known.
SharedBytes error(v1::ErrorCode code, std::string text, bool fatal, std::uint64_t requestId = 0,
                  std::string server = {});

// The scene moves to this server soon (Moving).
SharedBytes moving(std::string server);

// Last message to a peer that does not read its messages. The peer may reconnect.
SharedBytes tooSlow();

}  // namespace clothstream::delivery
