// SPDX-License-Identifier: MIT
// Frames from the device to everybody in their scene.
#include "server/stream/frame_packer.h"

#include <cassert>
#include <span>
#include <utility>

namespace clothstream::stream {

FramePacker::FramePacker(std::size_t capacity, std::function<void()> everySecond,
                         std::uint32_t encoderThreads)
    : everySecond_(std::move(everySecond)),
      workers_(encoderThreads),
      ring_(capacity),
      thread_([this] { run(); }) {}

FramePacker::~FramePacker() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FramePacker::push(CompleteFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    assert(waiting_ < ring_.size());
    std::swap(ring_[(first_ + waiting_++) % ring_.size()], frame);
  }
  changed_.notify_all();
}

void FramePacker::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_ == 0 && !busy_; });
}

void FramePacker::run() {
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
      pack();
      const std::lock_guard lock(mutex_);
      busy_ = false;
      changed_.notify_all();
    }
    if (Clock::now() >= nextCall) {
      everySecond_();
      nextCall = Clock::now() + std::chrono::seconds(1);
    }
  }
}

void FramePacker::pack() {
  v1::Frame& frame = *message_.mutable_frame();
  frame.set_tick_time_us(microseconds(frame_.tickStart));
  frame.set_state_hash(frame_.stateHash);
  frame.mutable_colliders()->Swap(&frame_.colliders);
  if (frame_.hasReport)
    frame.mutable_report()->Swap(&frame_.report);
  else
    frame.clear_report();
  for (const CompleteFrame::Recorded& recorded : frame_.recorded) {
    packet_.resize(recorded.encoder->packetBound());
    const encode::EncodedFrame encoded = recorded.encoder->entropyCode(recorded.frame, packet_);
    if (!frame_.discarded) publish(encoded.bytes, encoded.reconstructionHash);
  }
}

void FramePacker::publish(std::size_t bytes, std::uint64_t reconstructionHash) {
  v1::Frame& frame = *message_.mutable_frame();
  frame.mutable_packet()->assign(reinterpret_cast<const char*>(packet_.data()), bytes);
  frame.set_reconstruction_hash(reconstructionHash);
  const Clock::time_point complete = Clock::now();
  frame.set_packet_time_us(microseconds(complete));
  const auto packet = codec::parsePacket(std::span(packet_).first(bytes));
  PublishedFrame published = publishedFrame(packet->header, serialise(message_), complete);
  published.again = frame_.again;

  // Counted before anybody can have it, so that who holds a frame finds it counted.
  telemetry::SceneMetrics& metrics = frame_.scene->metrics;
  metrics.encode.record(seconds(complete - frame_.deviceDone));
  for (const Clock::time_point arrival : frame_.poseArrivals)
    metrics.inputToPacket.record(seconds(complete - arrival));
  frame_.poseArrivals.clear();  // other qualities show them later
  metrics.frames.add();
  if (published.key) metrics.keyFrames.add();
  metrics.packetBytes.add(bytes);

  frame_.scene->audience.publish(published);
}

}  // namespace clothstream::stream
