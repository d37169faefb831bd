// SPDX-License-Identifier: MIT
#include "clients/xr/panel/panel_drawing.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace clothstream::xr {
namespace {

constexpr Ink kGround{22, 23, 27, 240}, kText{0xd6, 0xd9, 0xe0}, kStrong{255, 255, 255},
    kQuiet{0xb4, 0xb8, 0xc2};
constexpr Ink kButton{0x2a, 0x2c, 0x33}, kHovered{0x3d, 0x5a, 0x80}, kChosen{0x35, 0x52, 0x7a},
    kOff{0x1d, 0x1f, 0x24};
constexpr Ink kOutline{0x8f, 0xb4, 0xe8}, kOffText{0x8b, 0x8f, 0x99};
constexpr float kScale = kPanelPixelsPerMetre;
constexpr float kInner = kPanelWidth - 2 * kPanelMargin;
constexpr std::size_t kPanelBands = static_cast<std::size_t>(kPanelHeight * kScale) / kChangeRows + 1;
constexpr float kDetailPart = 0.3F, kTextPart = 0.65F;  // of the width

void drawArea(const PanelArea& area, bool isHovered, TextPainter& painter, Picture& picture) {
  constexpr float kRadius = 10, kLine = 3;
  const float left = area.left * kScale, top = area.top * kScale;
  const float width = area.width * kScale, height = area.height * kScale;
  const Ink ground = !area.isEnabled ? kOff : isHovered ? kHovered : area.isChosen ? kChosen : kButton;
  drawRounded(picture, left, top, width, height, kRadius, ground);
  if (area.isChosen) drawRounded(picture, left, top, width, height, kRadius, kOutline, kLine);
  const float inset = std::min(kPanelMargin * kScale, 0.06F * width);
  const float middle = top + height / 2;
  const Ink ink = area.isEnabled ? kStrong : kOffText;
  const float detailSize = pixelsOf(kDetailSize);
  if (area.width > 0.6F * kInner) {
    const float size = pixelsOf(kTextSize);
    const float room = width * (area.detail.empty() ? 1 : kTextPart) - 2 * inset;
    painter.write(picture, area.text, left + inset, middle, size, ink, Align::kLeft, Weight::kRegular, room);
  } else {
    const float size = pixelsOf(kButtonSize);
    painter.write(picture, area.text, left + width / 2, middle, size, ink, Align::kCentre, Weight::kRegular,
                  width - 2 * inset);
  }
  if (!area.detail.empty())
    painter.write(picture, area.detail, left + width - inset, middle, detailSize, kQuiet, Align::kRight,
                  Weight::kRegular, kDetailPart * width);
}

}  // namespace

void drawPanel(const PanelDrawing& drawing, TextPainter& painter, Picture& picture) {
  clear(picture, static_cast<std::uint32_t>(std::lround(kPanelWidth * kScale)),
        static_cast<std::uint32_t>(std::lround(kPanelHeight * kScale)));
  drawRounded(picture, 0, 0, kPanelWidth * kScale, drawing.height * kScale, kPanelMargin * kScale, kGround);
  for (const PanelLine& line : drawing.lines) {
    const float middle = (line.top + kPanelRow / 2) * kScale;
    const float size = pixelsOf(line.isStrong ? kTitleSize : kTextSize);
    const Weight weight = line.isStrong ? Weight::kBold : Weight::kRegular;
    const float room = kInner * kScale * (line.detail.empty() ? 1 : 1 - kDetailPart);
    painter.write(picture, line.text, kPanelMargin * kScale, middle, size, line.isStrong ? kStrong : kText,
                  Align::kLeft, weight, room);
    const float detailSize = pixelsOf(kDetailSize);
    if (!line.detail.empty())
      painter.write(picture, line.detail, (kPanelWidth - kPanelMargin) * kScale, middle, detailSize, kQuiet,
                    Align::kRight, Weight::kRegular, kDetailPart * kInner * kScale);
  }
  for (std::size_t i = 0; i < drawing.areas.size(); ++i) {
    const bool isHovered = std::ranges::find(drawing.hovered, static_cast<int>(i)) != drawing.hovered.end();
    drawArea(drawing.areas[i], isHovered, painter, picture);
  }
  touch(picture);
}

PanelPainter::PanelPainter(const std::string& fontFile) : painter_(fontFile) {
  wanted_.lines.reserve(kPanelLines);
  wanted_.areas.reserve(kPanelAreas);
  for (Picture& picture : pictures_) picture.changes.reserve(kPanelBands);
  thread_ = std::thread([this] { run(); });
}

PanelPainter::~PanelPainter() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PanelPainter::paint(const PanelDrawing& drawing) {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = drawing;
    hasWanted_ = true;
  }
  changed_.notify_all();
}

const Picture& PanelPainter::newest() {
  const std::lock_guard lock(mutex_);
  if (std::exchange(hasFinished_, false)) std::swap(shown_, finished_);
  return pictures_[shown_];
}

void PanelPainter::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !hasWanted_ && !isDrawing_; });
}

void PanelPainter::run() {
  painter_.warm(pixelsOf(kTitleSize), Weight::kBold);
  for (const float size : {kTextSize, kButtonSize, kDetailSize})
    painter_.warm(pixelsOf(size), Weight::kRegular);
  PanelDrawing drawing;
  drawing.lines.reserve(kPanelLines);
  drawing.areas.reserve(kPanelAreas);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return hasWanted_ || ends_; });
    if (ends_) return;
    std::swap(drawing, wanted_);
    hasWanted_ = false;
    isDrawing_ = true;
    Picture& picture = pictures_[drawn_];
    lock.unlock();
    drawPanel(drawing, painter_, picture);
    lock.lock();
    // If newest() takes another picture meanwhile, the changes are those since an older one.
    const Picture& shown = pictures_[shown_];
    lock.unlock();
    findChanges(shown, picture);
    lock.lock();
    std::swap(drawn_, finished_);
    hasFinished_ = true;
    isDrawing_ = false;
    changed_.notify_all();
  }
}

}  // namespace clothstream::xr
