// SPDX-License-Identifier: MIT
// `clothstream-server doctor --accept`: whether a device computes what it should.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "server/doctor/device.h"
#include "server/doctor/finding.h"

namespace clothstream::doctor {

inline constexpr std::uint32_t kAcceptedTicks = 1000;

// Hash of the state of a built-in scene after kAcceptedTicks ticks. Every device has the same.
struct AcceptedState {
  std::string_view scene;
  std::uint64_t hash;
};
std::span<const AcceptedState> acceptedStates();

// Simulates a built-in scene. Halfway everything on the device is dropped, as after its loss: a new device
// goes on from the saved state. A device that shares kernels runs the second half twice in one batch, so that
// the kernels' shared forms are compared, too. Compares the hash of the last state, and the price of a tick
// with its time. Throws std::runtime_error if the device fails. Stops between ticks if `interrupted` returns
// true.
Finding accept(const OptionsFor& options, const AcceptedState& expected,
               const std::function<bool()>& interrupted);

}  // namespace clothstream::doctor
