// SPDX-License-Identifier: MIT
// A subscriber of a played recording, in the same process.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/decoder.h"
#include "server/recording/recorded_stream.h"
#include "server/scene/live_scene.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {

using schedule::Clock;

inline Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

inline RecordedStream streamOf(std::string bytes) {
  auto stream = RecordedStream::of(readerOf(std::move(bytes), CutFiles::read));
  if (!stream) throw std::runtime_error(stream.error());
  return std::move(*stream);
}

struct Seen {
  std::uint64_t tick = 0;
  bool key = false;
  std::uint64_t hash = 0;  // hash of the decoded frame
};

// Accepts every frame at once, and acknowledges it unless `acknowledges` is false.
class Viewer {
 public:
  explicit Viewer(scene::LiveScene& scene)
      : scene_(scene), mailbox_(std::make_shared<delivery::Mailbox>([] {})) {
    scene.subscribers.add(mailbox_);
    decoder_ = codec::Decoder::make(sampleLayout());
    mailbox_->subscribe(scene.description(), scene.shape(), scene.metrics);
    read(Clock::time_point{});
  }
  ~Viewer() { scene_.subscribers.remove(*mailbox_); }

  void read(Clock::time_point now) {
    while (const auto bytes = mailbox_->next(now)) {
      v1::ServerMessage message;
      ASSERT_TRUE(message.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())));
      if (message.has_frame())
        take(message.frame(), now);
      else if (message.has_notice())
        notices.push_back(message.notice());
      else if (message.has_playback())
        playbacks.push_back(message.playback());
      else if (message.has_parameter_changed())
        changes.push_back(message.parameter_changed());
    }
  }

  // Acknowledges the newest frame.
  void acknowledge(Clock::time_point now) { ASSERT_TRUE(mailbox_->acknowledge(decoder_->tick(), now)); }

  bool acknowledges = true;
  std::vector<Seen> frames;
  std::vector<v1::Notice> notices;
  std::vector<v1::Playback> playbacks;
  std::vector<v1::ParameterChanged> changes;

 private:
  void take(const v1::Frame& frame, Clock::time_point now) {
    const auto packet = std::as_bytes(std::span(frame.packet()));
    ASSERT_EQ(decoder_->decode(packet), codec::DecodeResult::ok);
    ASSERT_EQ(decoder_->reconstructionHash(), frame.reconstruction_hash());
    frames.push_back({decoder_->tick(), codec::parsePacket(packet)->header.kind == codec::PacketKind::key,
                      frame.reconstruction_hash()});
    if (acknowledges) acknowledge(now);
  }

  scene::LiveScene& scene_;
  std::shared_ptr<delivery::Mailbox> mailbox_;
  std::unique_ptr<codec::Decoder> decoder_;
};

}  // namespace clothstream::recording
