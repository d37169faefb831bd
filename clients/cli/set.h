// SPDX-License-Identifier: MIT
// `clothstream set`: changes parameters of a running scene.
#pragma once

#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/exit_code.h"
#include "clients/core/core.h"
#include "clients/native/address.h"
#include "proto/parameters/environment_parameters.h"

namespace clothstream::cli {

struct SetOptions {
  ServerAddress address = std::string(kDefaultAddress);
  std::string scene;
  std::uint32_t maxVertices = 0;  // 0: the default of cs_limits
  std::string cloth;              // empty: every cloth
  cs_cloth_settings settings;     // values that are not given stay as cs_keep_cloth_settings sets them
  // Numbers of each field; empty: no change.
  std::array<std::vector<float>, std::size(parameters::kEnvironmentParameters)> environment;
  std::string material;            // empty: no change
  std::optional<float> arealMass;  // kg/m^2
  // Collider of the scene or attachment that moves; at most one of them is not empty.
  std::string collider, attachment;
  std::vector<float> position, orientation;  // three and four numbers (quaternion x y z w); empty: no change
  bool jumps = false;                        // of the attachment
  std::optional<float> radius;               // of the collider, m

  SetOptions() { cs_keep_cloth_settings(&settings); }
};

bool changesAnything(const SetOptions& options);

// Joins the scene, sends the change, waits until the server has accepted or refused it, and leaves.
ExitCode set(const SetOptions& options);

}  // namespace clothstream::cli
