// SPDX-License-Identifier: MIT
#include "clients/xr/visit/visit.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "clients/xr/panel/panel_facts.h"
#include "clients/xr/stage/solids.h"
#include "clients/xr/visit/shown_cloth.h"
#include "proto/text/printable.h"

namespace clothstream::xr {
namespace {

constexpr std::uint64_t kSecond = 1'000'000;
constexpr std::uint64_t kFactsEvery = kSecond / 4, kScenesEvery = 5 * kSecond, kSaidFor = 6 * kSecond;
constexpr std::size_t kIndexTip = 10;
const Colour kControllerColour = fromSrgb(0x3C4048);
const Colour kRayColour = fromSrgb(0xE6A850);

}  // namespace

Visit::Visit(ConnectionOptions options, TextPainter& painter)
    : connection_(std::move(options)), reader_(painter), panel_(painter) {
  // The memory of longer texts is allocated when they come.
  facts_.status.reserve(256);
  said_.reserve(256);
}

void Visit::frame(const InputSample& sample, std::uint64_t nowUs, std::uint64_t displayUs) {
  pulseCount_ = 0;
  events_ |= connection_.update(nowUs);
  if (std::string notice = connection_.takeNotice(); !notice.empty()) say(std::move(notice), nowUs);
  {
    const Connection::Acquired acquired = connection_.acquire();
    cs_client* const client = acquired.client();
    if (client && clientNumber_ != connection_.clientNumber()) {
      clientNumber_ = connection_.clientNumber();
      sender_.forget();
      touch_.letGo();
      placedWithScene_ = placedWithScene_ && sceneName_ == cs_scene_name(client);
      sceneName_ = cs_scene_name(client);
    }
    place(sample, client);
    touch_.update(sample, placement_.toScene(), nowUs);
    if (client) {
      readEvents(client, nowUs);
      const ShownCloth cloth(client);
      point(&cloth, nowUs, client);
      touch_.grab(cloth);
    } else {
      point(nullptr, nowUs, nullptr);
    }
    sent_ = touch_.input();
    if (client) {
      sender_.send(client, sent_, displayUs);
      cs_play_out(client, nowUs, displayUs, nullptr);
      streamRate_ = static_cast<float>(cs_stream_rate(client));
      reader_.read(client, events_, false, stage_);
      events_ = 0;
    }
    if (nowUs - factsUs_ >= kFactsEvery) readFacts(client, nowUs);
    drawOwn(client);
  }
  showPanel(sample);
}

void Visit::hidden(std::uint64_t nowUs) {
  pulseCount_ = 0;
  events_ |= connection_.update(nowUs);
  touch_.leave();
  const Connection::Acquired acquired = connection_.acquire();
  if (!acquired.client() || clientNumber_ != connection_.clientNumber()) return;
  sent_ = touch_.input();
  sender_.send(acquired.client(), sent_, nowUs);
}

void Visit::say(std::string_view text, std::uint64_t nowUs) {
  said_ = text;
  saidUs_ = nowUs;
  factsUs_ = 0;
}

// Puts scene and panel before the user in the first frame, and when a scene has arrived.
void Visit::place(const InputSample& sample, const cs_client* client) {
  const bool hasScene = client && cs_vertex_count(client) > 0;
  const bool isWanted = !isPlaced_ || (hasScene && !placedWithScene_);
  if (!isWanted || !sample.hasHead || !isPossible(sample.head)) return;
  placement_.placeBefore(sample.head, hasScene ? boundsOf(client) : SceneBounds{});
  seat_.seat(sample.head);
  isPlaced_ = true;
  placedWithScene_ = hasScene;
  if (hasTrouble_) seat_.comeBefore(sample.head);
}

// A touch has priority over pointing.
void Visit::point(const Touchable* cloth, std::uint64_t nowUs, cs_client* client) {
  const Pose panel = placement_.toScene() * seat_.pose();
  for (const Side side : {Side::left, Side::right}) {
    const std::size_t i = indexOf(side);
    const Limb& limb = touch_.limb(side);
    hits_[i].reset();
    cs_cloth_point near{};
    const bool isBusy =
        touch_.grabber(side).holds() || (limb.isNew() && cloth && !panel_.isHeld(i) &&
                                         cloth->nearestPoint(limb.grip().position, Grabber::kReach, near));
    if (limb.present() && limb.hasRay() && !isBusy)
      hits_[i] = panel_.hit(panel, limb.ray().origin, limb.ray().direction);
    const bool presses = limb.present() && limb.points() && !isBusy;
    std::optional<PanelAction> action = panel_.point(i, hits_[i], presses);
    if (!action && limb.kind() == LimbKind::hand && limb.seen())
      action = panel_.poke(i, panel, limb.joints()[kIndexTip].position);
    if (panel_.isHeld(i)) touch_.use(side);
    if (!action) continue;
    addPulse(Pulse{.side = side, .amplitude = 0.4f, .seconds = 0.02f});
    act(*action, client);
    factsUs_ = nowUs > kFactsEvery ? nowUs - kFactsEvery : 0;
  }
}

void Visit::act(const PanelAction& action, cs_client* client) {
  switch (action.kind) {
    case PanelActionKind::kJoinScene:
      spdlog::info("The user chooses the scene {}", printable(action.scene));
      return connection_.join(action.scene);
    case PanelActionKind::kQuality:
      return connection_.setQuality(action.quality);
    case PanelActionKind::kRetry:
      return connection_.retry();
    case PanelActionKind::kRecenter:
      return recenter();
    case PanelActionKind::kLeave:
      leaves_ = true;
      return;
    case PanelActionKind::kReset:
      if (client) cs_reset_scene(client, "");
      return;
    case PanelActionKind::kPause:
    case PanelActionKind::kContinue:
      if (client) cs_pause_scene(client, "", action.kind == PanelActionKind::kPause ? 1 : 0);
      return;
  }
}

void Visit::readEvents(cs_client* client, std::uint64_t nowUs) {
  const std::uint64_t own = cs_participant_id(client);
  if (events_ & CS_EVENT_CONTACTS) {
    for (std::uint32_t i = 0; i < cs_contact_event_count(client); ++i) {
      cs_contact_event event;
      if (cs_get_contact_event(client, i, &event)) addPulse(pulseOf(event, own, sent_));
    }
  }
  if (events_ & CS_EVENT_GRABS) {
    for (std::uint32_t i = 0; i < cs_grab_event_count(client); ++i) {
      cs_grab_event event;
      if (!cs_get_grab_event(client, i, &event) || event.participant_id != own) continue;
      for (const Side side : {Side::left, Side::right})
        if (touch_.grabber(side).holds() && touch_.grabber(side).id() == event.grab_id)
          addPulse(pulseOf(event, side));
      if (event.kind == CS_GRAB_SLIPPED && event.vertices == 0) touch_.slipped(event.grab_id);
    }
  }
  cs_answer answer;
  if ((events_ & CS_EVENT_ANSWER) && cs_get_answer(client, &answer) && answer.error != 0)
    say(answer.error_text, nowUs);
  if ((events_ & CS_EVENT_ERROR) && cs_get_state(client) == CS_STATE_JOINED)
    say(cs_error_text(client), nowUs);
  if (events_ & CS_EVENT_NOTICE) say(cs_notice_text(client), nowUs);
}

void Visit::readFacts(cs_client* client, std::uint64_t nowUs) {
  factsUs_ = nowUs;
  if (client) {
    if (nowUs - scenesUs_ >= kScenesEvery && connection_.phase() == Phase::live) {
      scenesUs_ = nowUs;
      cs_list_scenes(client);
    }
    readPanelFacts(client, nowUs, facts_);
    const FrameTimes::Summary display = times_.summary(nowUs);
    if (display.frames > 0)
      facts_.figures.push_back({"display", FixedText::format("{:.0f} frames/s", display.framesPerSecond)});
  }
  facts_.quality = connection_.options().quality;
  if (!said_.empty() && nowUs - saidUs_ < kSaidFor) facts_.status = said_;
}

void Visit::showPanel(const InputSample& sample) {
  const Trouble& trouble = connection_.trouble();
  facts_.trouble = trouble.title;
  facts_.advice = trouble.advice;
  facts_.canRetry = connection_.phase() == Phase::refused;
  if (connection_.clientNumber() == 0 && trouble.title.empty())
    facts_.status = "Connecting to " + connection_.options().address;
  panel_.show(facts_);
  if (hasTrouble_ != !trouble.title.empty()) {
    hasTrouble_ = !trouble.title.empty();
    if (!hasTrouble_) {
      seat_.comeBack();
    } else if (sample.hasHead) {
      seat_.comeBefore(sample.head);
    }
  }
  stage_.panel = panel_.quad(placement_.toScene() * seat_.pose());
  stage_.panel.visible = isPlaced_;
}

void Visit::drawOwn(const cs_client* client) {
  stage_.own.clear();
  const Colour colour = colourOf(client ? cs_participant_id(client) : 0);
  const bool isReal = stage_.background == Background::kTransparent;
  for (const Side side : {Side::left, Side::right}) {
    const std::size_t i = indexOf(side);
    const Limb& limb = touch_.limb(side);
    if (limb.kind() == LimbKind::hand) addHand(sent_.hands[i].data(), colour, isReal, stage_.own);
    if (limb.kind() == LimbKind::controller) {
      Solid ball;
      ball.pose = limb.grip();
      ball.radius = ball.topRadius = Touch::kControllerRadius;
      ball.colour = kControllerColour;
      stage_.own.push_back(ball);
    }
    if (hits_[i] && limb.hasRay())
      addRay(limb.ray().origin, limb.ray().origin + hits_[i]->distance * limb.ray().direction, kRayColour,
             stage_.own);
  }
}

void Visit::addPulse(const std::optional<Pulse>& pulse) {
  if (pulse && pulseCount_ < pulses_.size()) pulses_[pulseCount_++] = *pulse;
}

}  // namespace clothstream::xr
