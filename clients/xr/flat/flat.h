// SPDX-License-Identifier: MIT
// Shows a visit without a headset: in a window, or as pictures in files.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "clients/xr/render/renderer.h"
#include "clients/xr/visit/visit.h"

namespace clothstream::xr {

struct FlatOptions {
  // Folder for PNG files, flat_0001.png and so on; it is made if it does not exist. "": a window, or the
  // present folder if there is no display.
  std::string pictures;
  std::uint32_t frames = 0;  // frames to draw; 0: a window until it is closed, or one picture
  std::uint32_t every = 1;   // of the frames, each n-th is written to a file
  std::uint32_t width = 1280, height = 800;
  std::uint32_t samples = 4;  // per pixel: 1, 2, 4 or 8
  ShadowDetail shadows = ShadowDetail::kFull;
  bool showsPanel = true;
};

class Flat {
 public:
  // Throws std::runtime_error that says what is missing. `visit` must outlive this.
  Flat(const FlatOptions& options, Visit& visit);
  ~Flat();
  Flat(const Flat&) = delete;
  Flat& operator=(const Flat&) = delete;

  // One displayed frame; it takes as long as a frame of the display, or 1/60 s. Returns false when all frames
  // are drawn, the window is closed, or the user has left. Throws std::runtime_error if a file cannot be
  // written.
  bool step();
  // The costs of the frames so far, as a sentence.
  std::string summary() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace clothstream::xr
