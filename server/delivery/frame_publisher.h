// SPDX-License-Identifier: MIT
// Encodes complete frames into packets and publishes them to the subscribers of their scene.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/delivery/subscribers.h"
#include "server/encode/encoder_threads.h"
#include "server/encode/frame_encoder.h"

namespace clothstream::delivery {

// One frame that is complete on the device, in one or more qualities.
struct CompleteFrame {
  struct Recorded {
    encode::FrameEncoder* encoder = nullptr;
    std::uint8_t quality = 0;
    bool key = false;  // a key frame was requested
    encode::RecordedFrame frame{};
  };

  CompleteFrame();
  ~CompleteFrame();
  CompleteFrame(CompleteFrame&&) noexcept;
  CompleteFrame& operator=(CompleteFrame&&) noexcept;

  Subscribers* subscribers = nullptr;
  telemetry::SceneMetrics* metrics = nullptr;
  std::vector<Recorded> recorded;  // one or more, in the order in which they are published
  bool discarded = false;          // the state is not healthy: the encoders' slots are freed, nothing is sent
  bool repeated = false;           // a frame of this tick was published before
  Clock::time_point deviceDone{};
  // Arrival times of the poses that this frame is the first to show.
  std::vector<Clock::time_point> poseArrivals;
  // Fields of the message, except packet, packet time and reconstruction hash, which the publisher adds.
  // Never null, except after a move.
  std::unique_ptr<v1::Frame> fields;
};

// Owns the thread that encodes and publishes. push() and drain() belong to the device's thread.
class FramePublisher {
 public:
  // At most `capacity` frames wait, at least 1. The number of slots in all encoders is enough for push()
  // never to wait. `everySecond` is called about once a second on the publisher's thread. `encoderThreads` is
  // the number of threads, the publisher's included, that predict large frames.
  FramePublisher(std::size_t capacity, std::function<void()> everySecond, std::uint32_t encoderThreads = 1);
  // Publishes the frames that wait, then ends.
  ~FramePublisher();
  FramePublisher(const FramePublisher&) = delete;
  FramePublisher& operator=(const FramePublisher&) = delete;

  // Swaps `frame` with an older one, whose memory the caller reuses. Waits while `capacity` frames wait.
  void push(CompleteFrame& frame);
  // Returns when every frame is published. No encoder and no scene of a pushed frame is used after that.
  void drain();
  // Number of frames that wait. Any thread.
  std::size_t waiting() const;
  // Workers for the encoders of the frames that will be pushed.
  codec::Workers& workers() { return workers_; }

 private:
  void run();
  void encode();
  void publish(const CompleteFrame::Recorded& recorded, const encode::EncodedFrame& encoded);

  std::function<void()> everySecond_;
  encode::EncoderThreads workers_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<CompleteFrame> ring_;
  std::size_t first_ = 0, waiting_ = 0;
  bool busy_ = false, stopping_ = false;

  // Owned by the thread and reused for every frame.
  CompleteFrame frame_;
  std::vector<std::byte> packet_;

  std::thread thread_;
};

}  // namespace clothstream::delivery
