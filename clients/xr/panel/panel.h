// SPDX-License-Identifier: MIT
// The panel in space: scenes, people, quality and figures under tabs, buttons, and what has gone wrong. It
// knows nothing of OpenXR, Vulkan or libclothstream.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/xr/panel/panel_drawing.h"
#include "clients/xr/stage/stage.h"
#include "clients/xr/text/fixed_text.h"
#include "clients/xr/text/painter.h"

namespace clothstream::xr {

// The panel shows these facts. The program fills them in (panel_facts.h does so from a cs_client).
struct PanelFacts {
  struct Scene {
    FixedText name;
    std::uint32_t participants = 0;
    bool operator==(const Scene&) const = default;
  };
  struct Person {
    FixedText name;
    FixedText detail;  // role, or "away"
    bool isSelf = false;
    bool operator==(const Person&) const = default;
  };
  // A figure of the stream, such as {"round trip", "12.1 ms"}.
  struct Figure {
    FixedText name, value;
    bool operator==(const Figure&) const = default;
  };

  std::string title = "ClothStream";  // first line
  std::string scene;                  // the joined one; "" if none
  std::vector<Scene> scenes;
  std::vector<Person> people;
  std::vector<Figure> figures;
  std::uint32_t quality = 0;  // limit of this client, 0 (finest) to 3
  bool mayAct = false;        // Reset and Pause are enabled
  bool isPaused = false;
  bool canRecenter = true;  // else the button is left out (flat)
  // They say what happened and what to do, and are "" if all is well. They stand in front of everything else.
  std::string trouble, advice;
  bool canRetry = false;  // adds a button "Try again" to the trouble
  std::string status;     // last line: a notice, or figures in short
  bool operator==(const PanelFacts&) const = default;
};

enum class PanelActionKind { kJoinScene, kReset, kPause, kContinue, kQuality, kRecenter, kRetry, kLeave };

// A press asks the program to do this.
struct PanelAction {
  PanelActionKind kind = PanelActionKind::kReset;
  std::string scene{};        // kJoinScene
  std::uint32_t quality = 0;  // kQuality
  bool operator==(const PanelAction&) const = default;
};

struct PanelHit {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();  // m from the upper left corner, to the right and down
  float distance = 0;                               // along the ray, m
  int button = -1;                                  // index, or -1 if there is none at the place
};

enum class PanelTab : std::uint32_t { kScenes = 0, kPeople = 1, kQuality = 2, kFigures = 3 };

// Has a thread that draws.
class Panel {
 public:
  // `painter` measures texts, and must outlive the panel.
  explicit Panel(TextPainter& painter);

  // Shows the facts. Lays out and draws only if they have changed. Allocates nothing after the first calls,
  // unless there are more scenes, people or characters of other scripts than before.
  void show(const PanelFacts& facts);
  // The quad for a stage, with the middle of its upper edge at the pose. Its picture is the newest that is
  // drawn, and valid until the next call.
  PanelQuad quad(const Pose& pose);
  // Waits until the picture of quad() has everything.
  void finish() { drawing_.finish(); }
  // Height of what is drawn, m. It depends on the facts; the quad is as high as the panel can be.
  float height() const { return drawn_.height; }

  // Where a ray meets the front of the panel, whose upper edge's middle is at `pose`. The direction has
  // length 1.
  std::optional<PanelHit> hit(const Pose& pose, const Eigen::Vector3f& origin,
                              const Eigen::Vector3f& direction) const;

  // Pointers that can hover and press at the same time: hands, controllers or a mouse.
  static constexpr std::size_t kPointers = 2;
  // A pointer is at `hit` (none: not on the panel). `pressed` is the state of its button. A press that begins
  // on a button and ends on the same button acts. Returns what it asks for; tabs and pages act within the
  // panel.
  std::optional<PanelAction> point(std::size_t pointer, const std::optional<PanelHit>& hit, bool pressed);
  // A finger tip at `tip`. Going through a button from the front acts at once. Returns what it asks for.
  std::optional<PanelAction> poke(std::size_t pointer, const Pose& pose, const Eigen::Vector3f& tip);
  // Whether a press of this pointer began on the panel and has not ended; the program does not grab cloth
  // then.
  bool isHeld(std::size_t pointer) const { return presses_[pointer].has_value(); }

  // The panel shows these lines of text and buttons.
  const std::vector<PanelLine>& lines() const { return drawn_.lines; }
  const std::vector<PanelArea>& buttons() const { return drawn_.areas; }

 private:
  // A press of a button does this.
  struct Effect {
    enum class Kind { kAction, kTab, kPage };
    Kind kind = Kind::kAction;
    PanelActionKind action = PanelActionKind::kReset;
    std::uint32_t value = 0;  // tab, page, quality, or index of the scene
  };
  struct Item {
    FixedText text, detail{};
    bool isChosen = false, isEnabled = true;
    Effect effect{};
  };

  void layOut();
  void layOutTrouble(float& top);
  void layOutTab(float& top);
  void layOutScenes(float& top);
  void addText(float& top, const std::string& text, std::size_t most, bool isStrong);
  void addButtons(float& top, std::span<const Item> items, float left = kPanelMargin);
  void addButton(float& top, const Item& item) { addButtons(top, {&item, 1}); }
  // Buttons or lines of a list, and buttons for its other pages if it has more than `most` rows.
  void addList(float& top, std::size_t most, std::span<const Item> items, bool areButtons);
  int buttonAt(const Eigen::Vector2f& place) const;
  std::optional<PanelAction> press(int button);

  TextPainter& painter_;
  PanelPainter drawing_;
  PanelFacts facts_;
  bool isEmpty_ = true;
  PanelTab tab_ = PanelTab::kScenes;
  std::uint32_t page_ = 0;
  PanelDrawing drawn_;
  std::vector<Effect> effects_;  // of each button
  // Memory of layOut().
  std::vector<PanelArea> areasBefore_;
  std::vector<Item> items_;
  std::vector<std::string_view> wrapped_;
  std::array<bool, kPointers> wasPressed_{};
  std::array<std::optional<int>, kPointers> presses_{};  // button on which a press began, or -1
  std::array<std::optional<bool>, kPointers> tipWasInFront_{};
};

}  // namespace clothstream::xr
