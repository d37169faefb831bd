// SPDX-License-Identifier: MIT
#include "server/hosting/unary_calls.h"

#include <utility>

#include "server/hosting/answers.h"
#include "server/scene/roles.h"

namespace clothstream::hosting {

UnaryCalls::UnaryCalls(const Access& access, SceneRequests& requests, SceneMaker& maker)
    : access_(access), requests_(requests), maker_(maker) {}

v1::ListScenesResponse UnaryCalls::listScenes(const Identity& by) const {
  return requests_.list(by);
}

tl::expected<v1::GetSceneResponse, v1::Error> UnaryCalls::getScene(const v1::GetSceneRequest& request,
                                                                   const Identity& by) const {
  if (const auto may = access_.mayUse(by, request.name()); !may)
    return tl::unexpected(toMessage(may.error()));
  return requests_.get(request);
}

void UnaryCalls::createScene(const v1::CreateSceneRequest& request, const CreateDone& done,
                             const Identity& by, Wanted wanted) {
  if (const auto may = access_.mayCreate(by); !may) return done(tl::unexpected(toMessage(may.error())));
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId)
    return done(refusal(v1::ERROR_CODE_NOT_FOUND,
                        "createScene.uploadedContentId: upload the scene and create it in the same stream"));
  if (auto accepted = maker_.create(request, {}, by.subject.tenant, std::move(wanted), done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void UnaryCalls::deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done, const Identity& by) {
  if (const auto may = access_.mayFromOutside(by, request.name(), scene::Action::deleteScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = maker_.remove(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void UnaryCalls::startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done,
                                const Identity& by) {
  if (const auto may = access_.mayFromOutside(by, request.scene(), scene::Action::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = maker_.startRecording(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void UnaryCalls::stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done,
                               const Identity& by) {
  if (const auto may = access_.mayFromOutside(by, request.scene(), scene::Action::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = maker_.stopRecording(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

tl::expected<v1::ControlSceneResponse, v1::Error> UnaryCalls::controlScene(
    const v1::ControlSceneRequest& request, const Identity& by) {
  if (const auto may = access_.mayFromOutside(by, request.name(), scene::Action::controlScene); !may)
    return tl::unexpected(toMessage(may.error()));
  return requests_.control(request, 0);
}

tl::expected<v1::ListBansResponse, v1::Error> UnaryCalls::listBans(const v1::ListBansRequest& request,
                                                                   const Identity& by) const {
  if (const auto may = access_.mayFromOutside(by, request.scene(), scene::Action::manageBans); !may)
    return tl::unexpected(toMessage(may.error()));
  return requests_.listBans(request);
}

tl::expected<v1::LiftBanResponse, v1::Error> UnaryCalls::liftBan(const v1::LiftBanRequest& request,
                                                                 const Identity& by) {
  if (const auto may = access_.mayFromOutside(by, request.scene(), scene::Action::manageBans); !may)
    return tl::unexpected(toMessage(may.error()));
  return requests_.liftBan(request);
}

}  // namespace clothstream::hosting
