// SPDX-License-Identifier: MIT
// Converts ticks between the inputs of the device and their message, bit-exactly.
#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/recording.pb.h"
#include "server/model/scene.h"
#include "server/scene/journal.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::recording {

// Overwrites `message`.
void write(const scene::AppliedTick& tick, v1::RecordedTick& message);

// Inputs of the device. The error says which part of the message does not fit this scene.
[[nodiscard]] tl::expected<simulation::TickInputs, std::string> toInputs(const v1::RecordedTick& message,
                                                                         const model::Scene& scene);
// Cloths of the scene with the parameters of the tick, which must contain some. `definition` is that of the
// scene.
[[nodiscard]] tl::expected<std::vector<model::Cloth>, std::string> toCloths(const v1::RecordedTick& message,
                                                                            const v1::Scene& definition);

}  // namespace clothstream::recording
