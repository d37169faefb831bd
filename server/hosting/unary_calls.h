// SPDX-License-Identifier: MIT
// Unary calls of a peer that is not in a stream.
#pragma once

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/access.h"
#include "server/hosting/scene_maker.h"
#include "server/hosting/scene_requests.h"
#include "server/identity/identity.h"

namespace clothstream::hosting {

using identity::Identity;

// Thread-safe. Each call checks that the peer may do what it asks for. By default the program itself calls.
class UnaryCalls {
 public:
  // The arguments must outlive this.
  UnaryCalls(const Access& access, SceneRequests& requests, SceneMaker& maker);

  v1::ListScenesResponse listScenes(const Identity& by = identity::local()) const;
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(const v1::GetSceneRequest& request,
                                                         const Identity& by = identity::local()) const;
  // Refuses a request for uploaded content, because uploads need a stream.
  void createScene(const v1::CreateSceneRequest& request, const CreateDone& done,
                   const Identity& by = identity::local(), Wanted wanted = {});
  void deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done,
                   const Identity& by = identity::local());
  void startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done,
                      const Identity& by = identity::local());
  void stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done,
                     const Identity& by = identity::local());
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request,
                                                                 const Identity& by = identity::local());
  tl::expected<v1::ListBansResponse, v1::Error> listBans(const v1::ListBansRequest& request,
                                                         const Identity& by = identity::local()) const;
  tl::expected<v1::LiftBanResponse, v1::Error> liftBan(const v1::LiftBanRequest& request,
                                                       const Identity& by = identity::local());

 private:
  const Access& access_;
  SceneRequests& requests_;
  SceneMaker& maker_;
};

}  // namespace clothstream::hosting
