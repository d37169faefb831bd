// SPDX-License-Identifier: MIT
// Server without a device, for targets that need a server.
#pragma once

#include "server/hosting/scene_server.h"

namespace clothstream::fuzz {

// Has the scene "played", which never has a frame, and a budget that knows a speed. The same in every call.
hosting::SceneServer& stillServer();

}  // namespace clothstream::fuzz
