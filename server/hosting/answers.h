// SPDX-License-Identifier: MIT
// Parts of the answers to requests about scenes.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/scene/live_scene.h"

namespace clothstream::hosting {

v1::Error toMessage(const messages::FieldError& error);
tl::unexpected<v1::Error> refusal(v1::ErrorCode code, std::string text);
v1::SceneSummary summaryOf(const scene::LiveScene& scene);

}  // namespace clothstream::hosting
