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
constexpr float kDetailPart = 0.3F, kTextPart = 0.65F;  // of the width

float pixels(float rows) {
  return rows * kPanelRow * kScale;
}

}  // namespace

PanelPainter::PanelPainter(const std::string& fontFile) : painter_(fontFile), thread_([this] { run(); }) {}

PanelPainter::~PanelPainter() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PanelPainter::paint(PanelDrawing drawing) {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = std::move(drawing);
    hasWanted_ = true;
  }
  changed_.notify_all();
}

const Picture& PanelPainter::newest() {
  const std::lock_guard lock(mutex_);
  if (std::exchange(hasFinished_, false)) std::swap(shown_, finished_);
  return shown_;
}

void PanelPainter::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !hasWanted_ && !isDrawing_; });
}

void PanelPainter::run() {
  Picture picture;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return hasWanted_ || ends_; });
    if (ends_) return;
    const PanelDrawing drawing = std::move(wanted_);
    hasWanted_ = false;
    isDrawing_ = true;
    lock.unlock();
    draw(drawing, picture);
    lock.lock();
    std::swap(picture, finished_);
    hasFinished_ = true;
    isDrawing_ = false;
    changed_.notify_all();
  }
}

void PanelPainter::draw(const PanelDrawing& drawing, Picture& picture) {
  clear(picture, static_cast<std::uint32_t>(std::lround(kPanelWidth * kScale)),
        static_cast<std::uint32_t>(std::lround(kPanelHeight * kScale)));
  drawRounded(picture, 0, 0, kPanelWidth * kScale, drawing.height * kScale, kPanelMargin * kScale, kGround);
  for (const PanelLine& line : drawing.lines) {
    const float middle = (line.top + kPanelRow / 2) * kScale;
    const float size = pixels(line.isStrong ? kTitleSize : kTextSize);
    const Weight weight = line.isStrong ? Weight::kBold : Weight::kRegular;
    const float room = kInner * kScale * (line.detail.empty() ? 1 : 1 - kDetailPart);
    painter_.write(picture, painter_.fit(line.text, size, room, weight), kPanelMargin * kScale, middle, size,
                   line.isStrong ? kStrong : kText, Align::kLeft, weight);
    const float detailSize = pixels(kDetailSize);
    if (!line.detail.empty())
      painter_.write(picture, painter_.fit(line.detail, detailSize, kDetailPart * kInner * kScale),
                     (kPanelWidth - kPanelMargin) * kScale, middle, detailSize, kQuiet, Align::kRight);
  }
  for (std::size_t i = 0; i < drawing.areas.size(); ++i) {
    const bool isHovered = std::ranges::find(drawing.hovered, static_cast<int>(i)) != drawing.hovered.end();
    drawArea(drawing.areas[i], isHovered, picture);
  }
  touch(picture);
}

void PanelPainter::drawArea(const PanelArea& area, bool isHovered, Picture& picture) {
  constexpr float kRadius = 10, kLine = 3;
  const float left = area.left * kScale, top = area.top * kScale;
  const float width = area.width * kScale, height = area.height * kScale;
  const Ink ground = !area.isEnabled ? kOff : isHovered ? kHovered : area.isChosen ? kChosen : kButton;
  drawRounded(picture, left, top, width, height, kRadius, ground);
  if (area.isChosen) drawRounded(picture, left, top, width, height, kRadius, kOutline, kLine);
  const float inset = std::min(kPanelMargin * kScale, 0.06F * width);
  const float middle = top + height / 2;
  const Ink ink = area.isEnabled ? kStrong : kOffText;
  const float detailSize = pixels(kDetailSize);
  if (area.width > 0.6F * kInner) {
    const float size = pixels(kTextSize);
    const float room = width * (area.detail.empty() ? 1 : kTextPart) - 2 * inset;
    painter_.write(picture, painter_.fit(area.text, size, room), left + inset, middle, size, ink);
  } else {
    const float size = pixels(kButtonSize);
    painter_.write(picture, painter_.fit(area.text, size, width - 2 * inset), left + width / 2, middle, size,
                   ink, Align::kCentre);
  }
  if (!area.detail.empty())
    painter_.write(picture, painter_.fit(area.detail, detailSize, kDetailPart * width), left + width - inset,
                   middle, detailSize, kQuiet, Align::kRight);
}

}  // namespace clothstream::xr
