// SPDX-License-Identifier: MIT
#include "server/messages/descriptors.h"

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/saved_state.pb.h"
#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream::messages {

void buildDescriptors() {
  // One message of each file.
  v1::RecordedTick::descriptor();
  v1::SavedScene::descriptor();
  v1::Scene::descriptor();
  v1::ServerMessage::descriptor();
}

}  // namespace clothstream::messages
