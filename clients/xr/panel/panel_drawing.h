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

#include "clients/xr/text/painter.h"

namespace clothstream::xr {

// Lengths are m from the upper left corner.
struct PanelLine {
  float top = 0;
  std::string text, detail;
  bool isStrong = false;  // large and bold
};
struct PanelArea {
  float left = 0, top = 0, width = 0, height = 0;
  std::string text, detail;
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

class PanelPainter {
 public:
  // `fontFile`: as in TextPainter.
  explicit PanelPainter(const std::string& fontFile);
  ~PanelPainter();
  PanelPainter(const PanelPainter&) = delete;
  PanelPainter& operator=(const PanelPainter&) = delete;

  // Asks for a picture. A picture that was asked for and not begun is left out.
  void paint(PanelDrawing drawing);
  // The newest complete picture; empty before the first. Valid and unchanged until the next call of newest().
  const Picture& newest();
  // Waits until everything that was asked for is drawn.
  void finish();

 private:
  void run();
  void draw(const PanelDrawing& drawing, Picture& picture);
  void drawArea(const PanelArea& area, bool isHovered, Picture& picture);

  TextPainter painter_;  // of the thread
  Picture shown_;        // of the caller

  std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  PanelDrawing wanted_;
  Picture finished_;
  bool hasWanted_ = false, hasFinished_ = false, isDrawing_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace clothstream::xr
