// SPDX-License-Identifier: MIT
// Draws the panel's picture on a thread, so that frames do not wait for it.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "clients/xr/text/fixed_text.h"
#include "clients/xr/text/painter.h"

namespace clothstream::xr {

// Lengths are m from the upper left corner.
struct PanelLine {
  float top = 0;
  FixedText text, detail;
  bool isStrong = false;  // large and bold
};
struct PanelArea {
  float left = 0, top = 0, width = 0, height = 0;
  FixedText text{}, detail{};
  bool isChosen = false, isEnabled = true;
  bool operator==(const PanelArea&) const = default;
};

struct PanelDrawing {
  std::vector<PanelLine> lines;
  std::vector<PanelArea> areas;
  std::array<int, 2> hovered{-1, -1};  // indices of areas
  float height = 0;                    // of what is drawn; the picture below is transparent
};

inline constexpr float kPanelWidth = 0.46F, kPanelRow = 0.05F, kPanelMargin = 0.018F, kPanelGap = 0.004F;
inline constexpr float kPanelRows = 15;  // most, with the title
inline constexpr float kPanelHeight = 2 * kPanelMargin + kPanelRow * kPanelRows;
inline constexpr float kPanelPixelsPerMetre = 1400;
// Sizes of texts, as fractions of the height of a row.
inline constexpr float kTitleSize = 0.5F, kTextSize = 0.4F, kButtonSize = 0.36F, kDetailSize = 0.34F;
inline constexpr float kLineHeight = 0.6F;  // of further lines of a text, in rows
// Lines and areas for which drawings have memory from the start; there are seldom more.
inline constexpr std::size_t kPanelLines = 32, kPanelAreas = 32;

// Size of a font in pixels, of a fraction of the height of a row.
inline float pixelsOf(float rows) {
  return rows * kPanelRow * kPanelPixelsPerMetre;
}

// Draws the panel into a picture, and gives it a new revision. Allocates nothing if the picture has had this
// size before, and the glyphs are known to the painter.
void drawPanel(const PanelDrawing& drawing, TextPainter& painter, Picture& picture);

class PanelPainter {
 public:
  // `fontFile`: as in TextPainter.
  explicit PanelPainter(const std::string& fontFile);
  ~PanelPainter();
  PanelPainter(const PanelPainter&) = delete;
  PanelPainter& operator=(const PanelPainter&) = delete;

  // Asks for a picture. A picture that was asked for and not begun is left out.
  void paint(const PanelDrawing& drawing);
  // The newest complete picture; empty before the first. Valid and unchanged until the next call of newest().
  // Its changes are those since the picture of the call before, mostly.
  const Picture& newest();
  // Waits until everything that was asked for is drawn.
  void finish();

 private:
  void run();

  TextPainter painter_;  // of the thread
  // One is shown, one is finished or unused, and the thread draws one. The thread also reads the shown one.
  std::array<Picture, 3> pictures_;

  std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  PanelDrawing wanted_;
  std::size_t shown_ = 0, finished_ = 1, drawn_ = 2;  // indices of pictures
  bool hasWanted_ = false, hasFinished_ = false, isDrawing_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace clothstream::xr
