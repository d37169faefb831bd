// SPDX-License-Identifier: MIT
// Frames from the device to everybody in their scene: entropy-coded, put into one message, published. A
// thread of its own.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include <google/protobuf/repeated_ptr_field.h>

#include "server/encode/encoder_threads.h"
#include "server/encode/frame_encoder.h"
#include "server/stream/clock.h"
#include "server/stream/live_scene.h"

namespace clothstream::stream {

// One frame that is complete on the device, and what travels with it.
struct CompleteFrame {
  // As it was recorded for one quality.
  struct Recorded {
    encode::FrameEncoder* encoder = nullptr;
    std::uint8_t quality = 0;
    bool key = false;  // wanted
    encode::RecordedFrame frame{};
  };
  LiveScene* scene = nullptr;
  std::vector<Recorded> recorded;  // one or more
  // Of a state that must not be shown: only its slot is freed.
  bool discarded = false;
  bool again = false;  // of a tick that had one
  std::uint64_t stateHash = 0;
  Clock::time_point tickStart{}, deviceDone{};
  google::protobuf::RepeatedPtrField<v1::ColliderState> colliders;
  // Of the poses whose effect it is the first to show.
  std::vector<Clock::time_point> poseArrivals;
  bool hasReport = false;
  v1::SimulationReport report;
};

// push() and drain() belong to the device's thread.
class FramePacker {
 public:
  // At most `capacity` frames wait: as many as there are slots in encoders. `everySecond` is called about
  // once a second, on the packer's thread, which predicts large frames together with others: so many in all.
  FramePacker(std::size_t capacity, std::function<void()> everySecond, std::uint32_t encoderThreads = 1);
  // What was pushed is packed first.
  ~FramePacker();
  FramePacker(const FramePacker&) = delete;
  FramePacker& operator=(const FramePacker&) = delete;

  // `frame` gets the contents of an older one, for its memory.
  void push(CompleteFrame& frame);
  // Returns when everything is packed: no encoder that was pushed is used any more.
  void drain();
  // For the encoders that will be pushed.
  codec::Workers& workers() { return workers_; }

 private:
  void run();
  void pack();
  void publish(std::size_t bytes, std::uint64_t reconstructionHash);

  std::function<void()> everySecond_;
  encode::EncoderThreads workers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<CompleteFrame> ring_;
  std::size_t first_ = 0, waiting_ = 0;
  bool busy_ = false, stopping_ = false;

  // The thread's own, used again for every frame.
  CompleteFrame frame_;
  std::vector<std::byte> packet_;
  v1::ServerMessage message_;

  std::thread thread_;
};

}  // namespace clothstream::stream
