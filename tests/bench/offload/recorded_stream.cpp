// SPDX-License-Identifier: MIT
#include "tests/bench/offload/recorded_stream.h"

#include <memory>
#include <stdexcept>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/frame_publisher.h"
#include "server/delivery/mailbox.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"

namespace clothstream::bench::offload {
namespace {

using schedule::Clock;

delivery::SharedBytes welcomeTo(const scene::LiveScene& live,
                                const delivery::DescriptionChunks& description) {
  v1::ServerMessage message;
  v1::Welcome& welcome = *message.mutable_welcome();
  welcome.set_protocol_version(1);
  welcome.set_codec(live.codec());
  welcome.set_scene(live.name());
  welcome.set_participant_id(1);
  welcome.set_server_name("clothstream-bench");
  welcome.set_description_content_id(description.contentId());
  return delivery::serialise(message);
}

bool isFrame(const delivery::SharedBytes& message) {
  v1::ServerMessage parsed;
  return parsed.ParseFromArray(message->data(), static_cast<int>(message->size())) && parsed.has_frame();
}

}  // namespace

RecordedStream recordStream(vulkan::Device& device, const model::Scene& scene, std::uint32_t ticks) {
  scene::LiveScene live(scene);
  delivery::FramePublisher publisher;
  scene::SceneHost host(device, live, publisher);
  const auto mailbox = std::make_shared<delivery::Mailbox>([] {});
  live.subscribers.add(mailbox);
  const auto description = live.description();
  mailbox->subscribe(description, live.shape(), live.metrics);

  RecordedStream stream;
  Clock::time_point now = Clock::time_point{} + std::chrono::seconds(1);
  stream.before.push_back(welcomeTo(live, *description));
  while (auto message = mailbox->next(now)) stream.before.push_back(std::move(*message));
  const auto tickTime = std::chrono::nanoseconds(1'000'000'000) / scene.simulationRate;
  for (std::uint32_t tick = 0; tick < ticks; ++tick) {
    host.begin(now);
    host.finish();
    publisher.drain();
    if (!host.status().healthy)
      throw std::runtime_error(fmt::format("tick {}: the state is not finite", tick));
    stream.stateHashes.push_back(host.status().stateHash);
    bool sent = false;
    while (auto message = mailbox->next(now)) {
      if (isFrame(*message)) {
        sent = true;
        if (!mailbox->acknowledge(host.tick(), now))
          throw std::runtime_error(fmt::format("tick {}: the server knows nothing of its frame", tick));
      }
      stream.frames.push_back(std::move(*message));
    }
    if (!sent) throw std::runtime_error(fmt::format("tick {}: the server sent no frame", tick));
    now += tickTime;
  }
  return stream;
}

}  // namespace clothstream::bench::offload
