// SPDX-License-Identifier: MIT
// Ticks between the device's inputs and their message, exact to the bit.
#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/recording.pb.h"
#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"
#include "server/scene/journal.h"

namespace clothstream::recording {

// Replaces what `message` says.
void write(const scene::AppliedTick& tick, v1::RecordedTick& message);

// What the device was given. The error says what in the message cannot be of this scene.
[[nodiscard]] tl::expected<simulation::TickInputs, std::string> toInputs(const v1::RecordedTick& message,
                                                                         const model::Scene& scene);
// The scene's cloths with the parameters that the tick brings, which must bring some. `definition` is that of
// the scene.
[[nodiscard]] tl::expected<std::vector<model::Cloth>, std::string> toCloths(const v1::RecordedTick& message,
                                                                            const v1::Scene& definition);

}  // namespace clothstream::recording
