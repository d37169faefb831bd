// SPDX-License-Identifier: MIT
#include "clients/xr/panel/panel.h"

#include <algorithm>
#include <utility>

namespace clothstream::xr {
namespace {

constexpr float kInner = kPanelWidth - 2 * kPanelMargin;
constexpr float kLabelPart = 0.26F;   // of the width, for a text on the left of buttons
constexpr float kPokeDepth = 0.03F;   // m behind the panel at which a finger no longer presses
constexpr std::size_t kListRows = 7;  // of one page
constexpr std::size_t kFigureRows = 10;
constexpr std::size_t kStatusBytes = 256;  // of memory for the status, which seldom has more

constexpr std::array<const char*, 4> kTabs{"Scenes", "People", "Quality", "Figures"};
constexpr std::array<const char*, 4> kQualities{"Full", "Half", "Quarter", "Coarsest"};

FixedText spaced(FixedText name) {
  name.replace('_', ' ');
  return name;
}

Eigen::Vector3f toPanel(const Pose& pose, const Eigen::Vector3f& point) {
  return inverse(pose).apply(point);
}

// Place on the panel, from its upper left corner, of a point in its frame.
Eigen::Vector2f placeOf(const Eigen::Vector3f& local) {
  return {local.x() + kPanelWidth / 2, -local.y()};
}

}  // namespace

Panel::Panel(TextPainter& painter) : painter_(painter), drawing_(painter.fontFile()) {
  for (const float size : {kTitleSize, kTextSize}) painter_.warm(pixelsOf(size), Weight::kRegular);
  facts_.status.reserve(kStatusBytes);
  drawn_.lines.reserve(kPanelLines);
  drawn_.areas.reserve(kPanelAreas);
  areasBefore_.reserve(kPanelAreas);
  effects_.reserve(kPanelAreas);
  items_.reserve(kPanelAreas);
  wrapped_.reserve(kPanelLines);
}

void Panel::show(const PanelFacts& facts) {
  if (!isEmpty_ && facts == facts_) return;
  isEmpty_ = false;
  facts_ = facts;
  layOut();
}

PanelQuad Panel::quad(const Pose& pose) {
  const Picture& picture = drawing_.newest();
  PanelQuad quad;
  quad.visible = picture.revision != 0;
  quad.pose = pose * Pose{{0, -kPanelHeight / 2, 0}, Eigen::Quaternionf::Identity()};
  quad.size = {kPanelWidth, kPanelHeight};
  quad.picture = &picture;
  return quad;
}

void Panel::layOut() {
  std::swap(areasBefore_, drawn_.areas);
  drawn_.lines.clear();
  drawn_.areas.clear();
  effects_.clear();
  drawn_.lines.push_back({kPanelMargin, facts_.title, spaced(facts_.scene), true});
  float top = kPanelMargin + kPanelRow;
  if (!facts_.trouble.empty())
    layOutTrouble(top);
  else
    layOutTab(top);
  drawn_.height = std::min(top + kPanelMargin, kPanelHeight);
  // Buttons that are elsewhere now are not those that were pointed at.
  if (areasBefore_ != drawn_.areas) {
    drawn_.hovered.fill(-1);
    for (std::optional<int>& press : presses_)
      if (press) press = -1;
  }
  drawing_.paint(drawn_);
}

void Panel::layOutTrouble(float& top) {
  addText(top, facts_.trouble, 3, true);
  addText(top, facts_.advice, 6, false);
  items_.clear();
  if (facts_.canRetry) items_.push_back({.text = "Try again", .effect = {.action = PanelActionKind::kRetry}});
  items_.push_back({.text = "Leave", .effect = {.action = PanelActionKind::kLeave}});
  addButtons(top, items_);
}

void Panel::layOutTab(float& top) {
  items_.clear();
  for (std::uint32_t i = 0; i < kTabs.size(); ++i)
    items_.push_back({.text = kTabs[i],
                      .isChosen = static_cast<PanelTab>(i) == tab_,
                      .effect = {.kind = Effect::Kind::kTab, .value = i}});
  addButtons(top, items_);
  items_.clear();
  switch (tab_) {
    case PanelTab::kScenes:
      layOutScenes(top);
      break;
    case PanelTab::kPeople:
      for (const PanelFacts::Person& person : facts_.people)
        items_.push_back(
            {.text = person.isSelf ? FixedText::format("{} (you)", person.name.view()) : person.name,
             .detail = person.detail});
      addList(top, kListRows + 1, items_, false);
      break;
    case PanelTab::kQuality:
      addText(top, "Best quality of your stream", 1, false);
      for (std::uint32_t i = 0; i < kQualities.size(); ++i)
        items_.push_back({.text = kQualities[i],
                          .isChosen = i == facts_.quality,
                          .effect = {.action = PanelActionKind::kQuality, .value = i}});
      addButtons(top, items_);
      addText(top, "A change joins the scene again.", 1, false);
      break;
    case PanelTab::kFigures:
      for (const PanelFacts::Figure& figure : facts_.figures)
        items_.push_back({.text = figure.name, .detail = figure.value});
      addList(top, kFigureRows, items_, false);
      break;
  }
  items_.clear();
  if (facts_.canRecenter)
    items_.push_back({.text = "Place before me", .effect = {.action = PanelActionKind::kRecenter}});
  items_.push_back({.text = "Leave", .effect = {.action = PanelActionKind::kLeave}});
  addButtons(top, items_);
  // Last, so that a long text moves no button.
  const float rest = (kPanelHeight - kPanelMargin - top - kPanelRow) / (kPanelRow * kLineHeight);
  addText(top, facts_.status, rest < 0 ? 0 : static_cast<std::size_t>(rest) + 1, false);
}

void Panel::layOutScenes(float& top) {
  const PanelActionKind pause = facts_.isPaused ? PanelActionKind::kContinue : PanelActionKind::kPause;
  items_.push_back(
      {.text = "Reset", .isEnabled = facts_.mayAct, .effect = {.action = PanelActionKind::kReset}});
  items_.push_back({.text = facts_.isPaused ? "Continue" : "Pause",
                    .isEnabled = facts_.mayAct,
                    .effect = {.action = pause}});
  addButtons(top, items_);
  items_.clear();
  for (std::uint32_t i = 0; i < facts_.scenes.size(); ++i) {
    const PanelFacts::Scene& scene = facts_.scenes[i];
    items_.push_back({.text = spaced(scene.name),
                      .detail = FixedText::format("{} {}", scene.participants,
                                                  scene.participants == 1 ? "person" : "people"),
                      .isChosen = scene.name == FixedText(facts_.scene),
                      .effect = {.action = PanelActionKind::kJoinScene, .value = i}});
  }
  addList(top, kListRows, items_, true);
}

void Panel::addText(float& top, const std::string& text, std::size_t most, bool isStrong) {
  if (most == 0) return;
  const float room = kInner * kPanelPixelsPerMetre * (isStrong ? 0.94F : 1);  // bold letters are wider
  painter_.wrap(text, pixelsOf(isStrong ? kTitleSize : kTextSize), room, most, wrapped_);
  for (std::size_t i = 0; i < wrapped_.size(); ++i)
    drawn_.lines.push_back(
        {top + static_cast<float>(i) * kPanelRow * kLineHeight, wrapped_[i], "", isStrong});
  top += kPanelRow * (1 + static_cast<float>(wrapped_.size() - 1) * kLineHeight);
}

void Panel::addButtons(float& top, std::span<const Item> items, float left) {
  const float width = (kPanelWidth - kPanelMargin - left + kPanelGap) / static_cast<float>(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    drawn_.areas.push_back({.left = left + static_cast<float>(i) * width,
                            .top = top + kPanelGap / 2,
                            .width = width - kPanelGap,
                            .height = kPanelRow - kPanelGap,
                            .text = items[i].text,
                            .detail = items[i].detail,
                            .isChosen = items[i].isChosen,
                            .isEnabled = items[i].isEnabled});
    effects_.push_back(items[i].effect);
  }
  top += kPanelRow;
}

void Panel::addList(float& top, std::size_t most, std::span<const Item> items, bool areButtons) {
  const bool hasPages = items.size() > most;
  const std::size_t rows = hasPages ? most - 1 : items.size();
  const std::size_t pages = hasPages ? (items.size() + rows - 1) / rows : 1;
  page_ = std::min(page_, static_cast<std::uint32_t>(pages - 1));
  const std::size_t first = page_ * rows;
  for (std::size_t i = first; i < std::min(first + rows, items.size()); ++i) {
    if (areButtons) {
      addButton(top, items[i]);
    } else {
      drawn_.lines.push_back({top, items[i].text, items[i].detail, false});
      top += kPanelRow;
    }
  }
  if (!hasPages) return;
  drawn_.lines.push_back({top, FixedText::format("{} of {}", page_ + 1, pages), "", false});
  const std::array<Item, 2> others{
      {{.text = "Back", .isEnabled = page_ > 0, .effect = {.kind = Effect::Kind::kPage, .value = page_ - 1}},
       {.text = "More",
        .isEnabled = page_ + 1 < pages,
        .effect = {.kind = Effect::Kind::kPage, .value = page_ + 1}}}};
  addButtons(top, others, kPanelMargin + kLabelPart * kInner);
}

std::optional<PanelHit> Panel::hit(const Pose& pose, const Eigen::Vector3f& origin,
                                   const Eigen::Vector3f& direction) const {
  const Eigen::Vector3f from = toPanel(pose, origin);
  const Eigen::Vector3f along = pose.orientation.conjugate() * direction;
  if (from.z() <= 0 || along.z() >= 0) return std::nullopt;
  const float distance = -from.z() / along.z();
  const Eigen::Vector2f place = placeOf(from + distance * along);
  if (place.x() < 0 || place.x() > kPanelWidth || place.y() < 0 || place.y() > drawn_.height)
    return std::nullopt;
  return PanelHit{place, distance, buttonAt(place)};
}

int Panel::buttonAt(const Eigen::Vector2f& place) const {
  for (std::size_t i = 0; i < drawn_.areas.size(); ++i) {
    const PanelArea& area = drawn_.areas[i];
    if (place.x() >= area.left && place.x() <= area.left + area.width && place.y() >= area.top &&
        place.y() <= area.top + area.height)
      return static_cast<int>(i);
  }
  return -1;
}

std::optional<PanelAction> Panel::point(std::size_t pointer, const std::optional<PanelHit>& hit,
                                        bool pressed) {
  // The hit can be older than the layout.
  const int button = hit ? buttonAt(hit->place) : -1;
  if (drawn_.hovered[pointer] != button) {
    drawn_.hovered[pointer] = button;
    drawing_.paint(drawn_);
  }
  const bool begins = pressed && !wasPressed_[pointer];
  const bool ends = !pressed && wasPressed_[pointer];
  wasPressed_[pointer] = pressed;
  if (begins && hit) presses_[pointer] = button;
  if (!ends) return std::nullopt;
  const std::optional<int> began = std::exchange(presses_[pointer], std::nullopt);
  return began && button >= 0 && *began == button ? press(button) : std::nullopt;
}

std::optional<PanelAction> Panel::poke(std::size_t pointer, const Pose& pose, const Eigen::Vector3f& tip) {
  const Eigen::Vector3f local = toPanel(pose, tip);
  const bool isInFront = local.z() > 0;
  const bool wasInFront = tipWasInFront_[pointer].value_or(isInFront);
  tipWasInFront_[pointer] = isInFront;
  if (isInFront || !wasInFront || local.z() < -kPokeDepth) return std::nullopt;
  return press(buttonAt(placeOf(local)));
}

std::optional<PanelAction> Panel::press(int button) {
  if (button < 0 || !drawn_.areas[static_cast<std::size_t>(button)].isEnabled) return std::nullopt;
  const Effect effect = effects_[static_cast<std::size_t>(button)];
  switch (effect.kind) {
    case Effect::Kind::kAction: {
      PanelAction action{.kind = effect.action};
      if (action.kind == PanelActionKind::kQuality) action.quality = effect.value;
      if (action.kind == PanelActionKind::kJoinScene) action.scene = facts_.scenes[effect.value].name.view();
      return action;
    }
    case Effect::Kind::kTab:
      tab_ = static_cast<PanelTab>(effect.value);
      page_ = 0;
      break;
    case Effect::Kind::kPage:
      page_ = effect.value;
      break;
  }
  layOut();
  return std::nullopt;
}

}  // namespace clothstream::xr
