// SPDX-License-Identifier: MIT
// Sends the frames of a scene through mailboxes over links of given rates. Time is simulated; there is no
// thread and no network.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/stream/frame_feedback.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/stream_layout.h"
#include "server/delivery/mailbox.h"

namespace clothstream::delivery {

using schedule::seconds;

// One subscriber behind a link of limited rate and latency that keeps the order of messages. Its endpoint
// writes without waiting, as into a large buffer. It acknowledges as clients do, and fails the test if it
// gets a frame that it cannot decode.
class SimulatedLink {
 public:
  SimulatedLink(const StreamShape& shape, std::uint8_t finest, Clock::time_point now) {
    mailbox->subscribe(nullptr, shape, metrics, finest);
    EXPECT_FALSE(mailbox->next(now));
  }

  void deliver(const PublishedFrame& frame) {
    published_[frame.message.get()] = frame;
    mailbox->deliver(frame);
  }
  void pass(Clock::duration time, Clock::time_point now) {
    const double carried = bytesPerSecond * seconds(time);
    budget_ = std::min(budget_ + carried, carried + kBurst);
    while (const auto message = mailbox->next(now)) {
      if (const auto quality = qualityIn(*message)) given = *quality;
      queue_.push_back(*message);
    }
    while (!queue_.empty() && static_cast<double>(queue_.front()->size()) <= budget_) {
      budget_ -= static_cast<double>(queue_.front()->size());
      arriving_.push_back({now + latency, queue_.front()});
      queue_.pop_front();
    }
    for (; !arriving_.empty() && arriving_.front().time <= now; arriving_.pop_front())
      arrive(arriving_.front().message, now);
    for (; !acks_.empty() && acks_.front().time <= now; acks_.pop_front())
      EXPECT_TRUE(mailbox->acknowledge(acks_.front().tick, now));
  }

  struct Arrived {
    std::uint64_t tick;
    std::uint8_t quality;
    Clock::duration age;
  };

  double bytesPerSecond = 1e9;
  Clock::duration latency = std::chrono::milliseconds(10);
  telemetry::SceneMetrics metrics;
  const std::shared_ptr<Mailbox> mailbox = std::make_shared<Mailbox>([] {});
  std::vector<Arrived> arrived;
  std::uint8_t given = 0;  // newest quality that the mailbox announced; it may still be on the link

 private:
  static constexpr double kBurst = 2000;  // bytes that an idle link takes at once
  struct Arriving {
    Clock::time_point time;
    SharedBytes message;
  };
  struct Ack {
    Clock::time_point time;
    std::uint64_t tick;
  };

  // Quality that a message announces; nullopt for a frame.
  std::optional<std::uint8_t> qualityIn(const SharedBytes& message) const {
    if (published_.contains(message.get())) return std::nullopt;
    v1::ServerMessage parsed;
    EXPECT_TRUE(parsed.ParseFromArray(message->data(), static_cast<int>(message->size())));
    EXPECT_TRUE(parsed.has_operating_point());
    return static_cast<std::uint8_t>(parsed.operating_point().quality());
  }

  void arrive(const SharedBytes& message, Clock::time_point now) {
    if (const auto quality = qualityIn(message)) {
      quality_ = *quality;
      return;
    }
    const PublishedFrame& frame = published_.at(message.get());
    // Decoders reject frames that are not newer.
    if (!arrived.empty()) {
      ASSERT_GT(frame.tick, arrived.back().tick);
    }
    if (!frame.key) {
      ASSERT_FALSE(arrived.empty());
      ASSERT_EQ(frame.quality, arrived.back().quality) << "tick " << frame.tick;
      ASSERT_EQ(frame.referenceTick, arrived.back().tick) << "tick " << frame.tick;
    }
    ASSERT_EQ(frame.quality, quality_) << "tick " << frame.tick;
    arrived.push_back({frame.tick, frame.quality, now - frame.complete});
    if (acknowledgement_.due(static_cast<std::uint64_t>(1e6 * seconds(now.time_since_epoch()))))
      acks_.push_back({now + latency, frame.tick});
  }

  double budget_ = 0;
  std::deque<SharedBytes> queue_;
  std::deque<Arriving> arriving_;
  std::deque<Ack> acks_;
  // Indexed by the address of the message, which is unique because the messages are kept.
  std::map<const void*, PublishedFrame> published_;
  client::Acknowledgement acknowledgement_;
  std::uint8_t quality_ = 0;  // newest quality that was announced
};

// Encodes the requested frames, as SceneHost does.
class SimulatedScene {
 public:
  static constexpr std::size_t kFrameBytes = 1000;  // of quality 0
  static constexpr double kPartOfFiner = 0.62;      // bytes of a quality, divided by those of the next finer

  explicit SimulatedScene(const StreamShape& shape) : shape_(shape) {}

  SimulatedLink& join(std::uint8_t finest = 0) {
    return *links_.emplace_back(std::make_unique<SimulatedLink>(shape_, finest, now));
  }
  // Bytes of all frames in the finest quality.
  double fullRate() const { return static_cast<double>(kFrameBytes) * shape_.rate; }

  void pass(Clock::duration time) {
    for (const Clock::time_point end = now + time; now < end;) {
      now += kStep;
      if (now >= due_) {
        due_ += std::chrono::nanoseconds(1'000'000'000) / shape_.rate;
        makeFrame();
      }
      for (const auto& link : links_) link->pass(kStep, now);
    }
  }
  std::uint64_t frames() const { return tick_; }
  // Number of encoded frames for each quality.
  std::array<std::uint64_t, codec::kMaxQualities> encoded{};

  Clock::time_point now = Clock::time_point(std::chrono::hours(1));

 private:
  static constexpr std::chrono::milliseconds kStep{1}, kKeyFrameInterval{100};
  struct Encoder {
    bool alive = false;
    Clock::time_point lastKey{};
  };

  void makeFrame() {
    ++tick_;
    RequestedFrames requested;
    for (const auto& link : links_) requested |= link->mailbox->requested(now);
    double bytes = kFrameBytes;
    for (std::uint8_t quality = 0; quality < shape_.qualities; ++quality, bytes *= kPartOfFiner) {
      Encoder& encoder = encoders_[quality];
      const bool wanted = (requested.qualities >> quality & 1) != 0;
      const bool asked =
          (requested.keyFrames >> quality & 1) != 0 && now - encoder.lastKey >= kKeyFrameInterval;
      const bool key = wanted && (asked || !encoder.alive);
      encoder.alive = wanted;
      if (!wanted) continue;
      ++encoded[quality];
      if (key) encoder.lastKey = now;
      const PublishedFrame frame{
          .message = std::make_shared<std::vector<std::byte>>(static_cast<std::size_t>(bytes)),
          .tick = tick_,
          .key = key,
          .referenceTick = key ? 0 : tick_ - 1,
          .quality = quality,
          .complete = now};
      for (const auto& link : links_) link->deliver(frame);
    }
  }

  const StreamShape shape_;
  std::vector<std::unique_ptr<SimulatedLink>> links_;
  std::array<Encoder, codec::kMaxQualities> encoders_;
  Clock::time_point due_ = now;
  std::uint64_t tick_ = 0;
};

}  // namespace clothstream::delivery
