// SPDX-License-Identifier: MIT
#include "server/delivery/frame_publisher.h"

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::delivery {
namespace {

void publish(CompleteFrame& frame, const CompleteFrame::Recorded& recorded,
             const encode::EncodedFrame& encoded, std::span<const std::byte> packet) {
  frame.fields->set_reconstruction_hash(encoded.reconstructionHash);
  const Clock::time_point complete = Clock::now();
  frame.fields->set_packet_time_us(schedule::microseconds(complete));
  const PublishedFrame published{.message = serialiseFrame(*frame.fields, packet),
                                 .tick = recorded.frame.tick,
                                 .key = encoded.kind == codec::PacketKind::key,
                                 .referenceTick = encoded.referenceTick,
                                 .quality = recorded.quality,
                                 .complete = complete,
                                 .repeated = frame.repeated};

  // Counted before it is published, so that a subscriber that has the frame finds it counted.
  telemetry::SceneMetrics& metrics = *frame.metrics;
  metrics.encode.record(schedule::seconds(complete - frame.deviceDone));
  metrics.trace.add({published.key ? "encode a key frame" : "encode a frame", telemetry::TraceTrack::packets,
                     frame.deviceDone, complete - frame.deviceDone, published.tick});
  for (const Clock::time_point arrival : frame.poseArrivals)
    metrics.inputToPacket.record(schedule::seconds(complete - arrival));
  frame.poseArrivals.clear();  // the first published quality counts
  metrics.frames.add();
  if (published.key) metrics.keyFrames.add();
  metrics.packetBytes.add(encoded.bytes);

  frame.subscribers->publish(published);
}

// `packet` is memory that the thread reuses.
void encode(CompleteFrame& frame, std::vector<std::byte>& packet) {
  for (const CompleteFrame::Recorded& recorded : frame.recorded) {
    if (const std::size_t bound = recorded.encoder->packetBound(); packet.size() < bound)
      packet.resize(bound);
    const encode::EncodedFrame encoded = recorded.encoder->entropyCode(recorded.frame, packet);
    if (!frame.discarded) publish(frame, recorded, encoded, std::span(packet).first(encoded.bytes));
  }
}

}  // namespace

CompleteFrame::CompleteFrame() : fields(std::make_unique<v1::Frame>()) {}
CompleteFrame::~CompleteFrame() = default;
CompleteFrame::CompleteFrame(CompleteFrame&&) noexcept = default;
CompleteFrame& CompleteFrame::operator=(CompleteFrame&&) noexcept = default;

FramePublisher::Queue::Queue(FramePublisher& publisher)
    : publisher_(publisher), turn_{this}, place_(turn_.begin()) {}

void FramePublisher::Queue::push(CompleteFrame& frame) {
  {
    std::unique_lock lock(publisher_.mutex_);
    publisher_.published_.wait(lock, [&] { return size_ < frames_.size(); });
    std::swap(frames_[(first_ + size_) % frames_.size()], frame);
    ++publisher_.unpublished_;
    if (++size_ > 1) return;  // has its turn, or gets one when the frame before is published
    publisher_.turns_.splice(publisher_.turns_.end(), turn_);
  }
  publisher_.hasTurns_.notify_one();
}

void FramePublisher::Queue::drain() {
  std::unique_lock lock(publisher_.mutex_);
  isDraining_ = true;
  if (turn_.empty()) publisher_.turns_.splice(publisher_.turns_.begin(), publisher_.turns_, place_);
  publisher_.published_.wait(lock, [&] { return size_ == 0; });
  isDraining_ = false;
}

FramePublisher::FramePublisher(std::uint32_t threads, std::uint32_t workers) : workers_(workers) {
  assert(threads > 0);
  try {
    for (std::uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
  } catch (...) {
    stop();
    throw;
  }
}

FramePublisher::~FramePublisher() {
  assert(unpublished_ == 0);
  stop();
}

void FramePublisher::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  hasTurns_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

std::uint32_t FramePublisher::suitedTo(std::uint32_t processors) {
  return std::clamp(processors * 3 / 4, 1u, 16u);
}

void FramePublisher::drain() {
  std::unique_lock lock(mutex_);
  published_.wait(lock, [&] { return unpublished_ == 0; });
}

std::size_t FramePublisher::waiting() const {
  const std::lock_guard lock(mutex_);
  return unpublished_ - inWork_;
}

void FramePublisher::run() {
  telemetry::nameThread("publisher");
  std::vector<std::byte> packet;
  std::unique_lock lock(mutex_);
  for (;;) {
    hasTurns_.wait(lock, [&] { return !turns_.empty() || stopping_; });
    if (turns_.empty()) return;
    Queue& queue = *turns_.front();
    queue.turn_.splice(queue.turn_.end(), turns_, queue.place_);
    CompleteFrame& frame = queue.frames_[queue.first_];
    ++inWork_;
    lock.unlock();
    encode(frame, packet);
    lock.lock();
    --inWork_;
    --unpublished_;
    --queue.size_;
    // An empty ring starts again with the memory that it used last.
    queue.first_ = queue.size_ == 0 ? 0 : (queue.first_ + 1) % queue.frames_.size();
    if (queue.size_ > 0)
      turns_.splice(queue.isDraining_ ? turns_.begin() : turns_.end(), queue.turn_, queue.place_);
    published_.notify_all();
  }
}

}  // namespace clothstream::delivery
