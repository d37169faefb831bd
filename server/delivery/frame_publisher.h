// SPDX-License-Identifier: MIT
// Encodes complete frames into packets and publishes them to the subscribers of their scene.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "server/delivery/subscribers.h"
#include "server/encode/frame_encoder.h"
#include "server/encode/worker_threads.h"

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

// Owns the threads that encode and publish. Frames of one scene are published one at a time and in order,
// those of different scenes at the same time. Scenes with frames that wait take turns. An exception while a
// frame is encoded or published ends the process.
class FramePublisher {
 public:
  // Frames of one scene that are not published yet. Belongs to the device's thread.
  class Queue {
   public:
    // The publisher must outlive the queue.
    explicit Queue(FramePublisher& publisher);
    // Drains.
    ~Queue() { drain(); }
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    // Swaps `frame` with an older one, whose memory the caller reuses. Waits while the queue is full, which
    // it never is with frames of one encoder for each quality.
    void push(CompleteFrame& frame);
    // Returns when every frame of the queue is published. They come before those of other scenes. No encoder
    // of a pushed frame is used after that, and neither are its subscribers and metrics.
    void drain();

   private:
    friend class FramePublisher;

    // A frame that waits has a slot of an encoder. One that is being published may have none any more.
    static constexpr std::size_t kCapacity = codec::kMaxQualities * encode::FrameEncoder::kSlots + 1;

    FramePublisher& publisher_;
    // The publisher's lock protects all below, except for the first frame while it is being published.
    std::array<CompleteFrame, kCapacity> frames_;  // a ring
    std::size_t first_ = 0, size_ = 0;
    bool isDraining_ = false;
    std::list<Queue*> turn_;  // its element is here or among the publisher's turns, so that none is allocated
    const std::list<Queue*>::iterator place_;
  };

  // `threads`, at least 1, encode and publish. `workers` is the number of threads, one of these included,
  // that predict a large frame.
  explicit FramePublisher(std::uint32_t threads = 1, std::uint32_t workers = 1);
  // Every queue must have ended.
  ~FramePublisher();
  FramePublisher(const FramePublisher&) = delete;
  FramePublisher& operator=(const FramePublisher&) = delete;

  // Number of `threads` for a machine with `processors` processors: three quarters of them, 1 to 16. The
  // device's thread and the endpoints need the others.
  static std::uint32_t suitedTo(std::uint32_t processors);

  // Returns when every frame of every queue is published. Belongs to the device's thread.
  void drain();
  // Number of frames that wait. Any thread.
  std::size_t waiting() const;
  // Workers for the encoders of the frames that will be pushed. Others may use them, too.
  codec::Workers& workers() { return workers_; }

 private:
  void run();
  void stop();

  encode::WorkerThreads workers_;
  mutable std::mutex mutex_;  // protects all below, and the queues
  std::condition_variable hasTurns_, published_;
  std::list<Queue*> turns_;  // queues with frames of which none is being published; the first is next
  std::size_t unpublished_ = 0, inWork_ = 0;  // frames
  bool stopping_ = false;

  std::vector<std::thread> threads_;
};

}  // namespace clothstream::delivery
