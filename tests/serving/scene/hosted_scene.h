// SPDX-License-Identifier: MIT
// A scene host without a server. Runs single ticks and decodes their frames. The only other thread is that of
// the publisher.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/decoder.h"
#include "server/delivery/frame_publisher.h"
#include "server/delivery/mailbox.h"
#include "server/encode/frame_encoder.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"
#include "tests/serving/small_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {

// One scene on the shared device, with a subscriber that reads everything.
class HostedScene {
 public:
  // `prepare` is called before the scene's host is created. `journal` may be null.
  explicit HostedScene(
      model::Scene scene = smallScene(), std::size_t subscribers = 1,
      const std::function<void(scene::LiveScene&)>& prepare = [](scene::LiveScene&) {},
      std::shared_ptr<scene::Journal> journal = nullptr)
      : live(std::move(scene), {}, std::move(journal)), host((prepare(live), device()), live, publisher) {
    for (std::size_t i = 0; i < subscribers; ++i) {
      mailboxes.push_back(std::make_shared<delivery::Mailbox>([] {}));
      live.subscribers.add(mailboxes.back());
      mailboxes.back()->subscribe(live.description(), live.shape(), live.metrics);
      while (mailboxes.back()->next(now)) {
      }
    }
    decoder = codec::Decoder::make(encode::streamLayout(live.start(), scene::kEpoch));
  }
  ~HostedScene() { publisher.drain(); }

  // Runs one tick; all subscribers read its frame.
  void tick() {
    now += std::chrono::seconds(1);  // so that no key frame has to wait
    host.begin(now);
    finish();
  }
  // The same of a tick that has begun.
  void finish() {
    host.finish();
    publisher.drain();
    for (const auto& mailbox : mailboxes)
      while (const auto message = mailbox->next(now)) {
        v1::ServerMessage parsed;
        ASSERT_TRUE(parsed.ParseFromArray((*message)->data(), static_cast<int>((*message)->size())));
        if (parsed.has_frame()) {
          if (mailbox == mailboxes.front()) see(parsed.frame());
          ASSERT_TRUE(mailbox->acknowledge(host.tick(), now));
        } else if (mailbox == mailboxes.front()) {
          announced.push_back(parsed);
        }
      }
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) tick();
  }

  void change(model::ParameterChange change) {
    ASSERT_TRUE(live.inbox.postChange({.participant = 5, .change = std::move(change)}));
  }

  // State hashes of all frames.
  std::vector<std::uint64_t> stateHashes() const {
    std::vector<std::uint64_t> hashes;
    for (const v1::Frame& frame : frames) hashes.push_back(frame.state_hash());
    return hashes;
  }

  scene::LiveScene live;
  delivery::FramePublisher publisher;
  scene::SceneHost host;
  std::vector<std::shared_ptr<delivery::Mailbox>> mailboxes;
  std::unique_ptr<codec::Decoder> decoder;
  schedule::Clock::time_point now = schedule::Clock::now();
  std::vector<v1::Frame> frames;
  std::vector<bool> keys;
  std::vector<v1::ServerMessage> announced;

 private:
  void see(const v1::Frame& frame) {
    const auto packet = std::as_bytes(std::span(frame.packet()));
    ASSERT_EQ(decoder->decode(packet), codec::DecodeResult::ok);
    EXPECT_EQ(decoder->reconstructionHash(), frame.reconstruction_hash());
    frames.push_back(frame);
    keys.push_back(codec::parsePacket(packet)->header.kind == codec::PacketKind::key);
  }
};

}  // namespace clothstream::tests
