// SPDX-License-Identifier: MIT
#include "server/delivery/frame_publisher.h"

#include <exception>
#include <span>
#include <utility>

#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::delivery {

CompleteFrame::CompleteFrame() : fields(std::make_unique<v1::Frame>()) {}
CompleteFrame::~CompleteFrame() = default;
CompleteFrame::CompleteFrame(CompleteFrame&&) noexcept = default;
CompleteFrame& CompleteFrame::operator=(CompleteFrame&&) noexcept = default;

FramePublisher::FramePublisher(std::size_t capacity, std::function<void()> everySecond,
                               std::uint32_t encoderThreads)
    : everySecond_(std::move(everySecond)),
      workers_(encoderThreads),
      ring_(capacity),
      thread_([this] { run(); }) {}

FramePublisher::~FramePublisher() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FramePublisher::push(CompleteFrame& frame) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_ < ring_.size(); });
    std::swap(ring_[(first_ + waiting_++) % ring_.size()], frame);
  }
  changed_.notify_all();
}

void FramePublisher::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_ == 0 && !busy_; });
}

std::size_t FramePublisher::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

void FramePublisher::run() {
  telemetry::nameThread("publisher");
  Clock::time_point nextCall = Clock::now() + std::chrono::seconds(1);
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_until(lock, nextCall, [&] { return waiting_ > 0 || stopping_; });
      if (waiting_ == 0 && stopping_) return;
      busy_ = waiting_ > 0;
      if (busy_) {
        std::swap(frame_, ring_[first_]);
        first_ = (first_ + 1) % ring_.size();
        --waiting_;
      }
    }
    if (busy_) {
      changed_.notify_all();
      encode();
      const std::lock_guard lock(mutex_);
      busy_ = false;
      changed_.notify_all();
    }
    if (Clock::now() >= nextCall) {
      try {
        everySecond_();
      } catch (const std::exception& failure) {
        spdlog::error("the check of every second failed: {}", failure.what());
      }
      nextCall = Clock::now() + std::chrono::seconds(1);
    }
  }
}

void FramePublisher::encode() {
  for (const CompleteFrame::Recorded& recorded : frame_.recorded) {
    packet_.resize(recorded.encoder->packetBound());
    const encode::EncodedFrame encoded = recorded.encoder->entropyCode(recorded.frame, packet_);
    if (!frame_.discarded) publish(recorded, encoded);
  }
}

void FramePublisher::publish(const CompleteFrame::Recorded& recorded, const encode::EncodedFrame& encoded) {
  frame_.fields->set_reconstruction_hash(encoded.reconstructionHash);
  const Clock::time_point complete = Clock::now();
  frame_.fields->set_packet_time_us(schedule::microseconds(complete));
  const PublishedFrame published{
      .message = serialiseFrame(*frame_.fields, std::span(packet_).first(encoded.bytes)),
      .tick = recorded.frame.tick,
      .key = encoded.kind == codec::PacketKind::key,
      .referenceTick = encoded.referenceTick,
      .quality = recorded.quality,
      .complete = complete,
      .repeated = frame_.repeated};

  // Counted before it is published, so that a subscriber that has the frame finds it counted.
  telemetry::SceneMetrics& metrics = *frame_.metrics;
  metrics.encode.record(schedule::seconds(complete - frame_.deviceDone));
  metrics.trace.add({published.key ? "encode a key frame" : "encode a frame", telemetry::TraceTrack::packets,
                     frame_.deviceDone, complete - frame_.deviceDone, published.tick});
  for (const Clock::time_point arrival : frame_.poseArrivals)
    metrics.inputToPacket.record(schedule::seconds(complete - arrival));
  frame_.poseArrivals.clear();  // the first published quality counts
  metrics.frames.add();
  if (published.key) metrics.keyFrames.add();
  metrics.packetBytes.add(encoded.bytes);

  frame_.subscribers->publish(published);
}

}  // namespace clothstream::delivery
