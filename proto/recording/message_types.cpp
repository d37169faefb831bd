// SPDX-License-Identifier: MIT
#include "proto/recording/message_types.h"

#include <memory>

#include <google/protobuf/message.h>

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream::recording {

const google::protobuf::Descriptor& typeOf(Topic topic) {
  switch (topic) {
    case Topic::description:
      return *v1::StreamDescription::descriptor();
    case Topic::frames:
      return *v1::Frame::descriptor();
    case Topic::reports:
      return *v1::SimulationReport::descriptor();
    case Topic::parameters:
      return *v1::ParameterChanged::descriptor();
    case Topic::events:
      return *v1::TickEvents::descriptor();
    case Topic::notices:
      return *v1::Notice::descriptor();
    case Topic::participants:
      return *v1::ParticipantEvent::descriptor();
    case Topic::scene:
      return *v1::RecordedScene::descriptor();
    case Topic::ticks:
      return *v1::RecordedTick::descriptor();
    case Topic::checkpoints:
      break;
  }
  return *v1::Checkpoint::descriptor();
}

bool isReadable(Topic topic, std::string_view bytes) {
  const auto* prototype = google::protobuf::MessageFactory::generated_factory()->GetPrototype(&typeOf(topic));
  const std::unique_ptr<google::protobuf::Message> message(prototype->New());
  return message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace clothstream::recording
