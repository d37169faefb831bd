// SPDX-License-Identifier: MIT
// Motions of one cloth for measuring the codec: position-based dynamics with self-collision and gusts, in
// double precision. The motion depends only on its settings.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace clothstream::bench {

enum class MotionScene : std::uint8_t {
  drape,    // falls on a sphere and slides to the floor
  curtain,  // hangs in folds; a sphere swings through it
  flag,     // held at two corners in a gusty wind
};

struct MotionSettings {
  std::string name;
  MotionScene scene = MotionScene::drape;
  double wind = 1;  // of the flag
  std::uint32_t size = 100;
  std::uint32_t frames = 600;  // at 72 Hz
  std::uint32_t substeps = 20;
  double damping = 2;
  std::uint32_t seed = 1;
};

// Calls use(frame, positions) for each frame: 3 floats a vertex, metres, row-major.
void playMotion(const MotionSettings& settings,
                const std::function<void(std::uint32_t, std::span<const float>)>& use);

}  // namespace clothstream::bench
