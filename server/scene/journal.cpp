// SPDX-License-Identifier: MIT
#include "server/scene/journal.h"

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {

messages::Result<std::string> Journal::start(const std::string&) {
  return tl::unexpected(noJournalError("startRecording"));
}

messages::Result<v1::StopRecordingResponse> Journal::stop() {
  return tl::unexpected(noJournalError("stopRecording"));
}

messages::FieldError noJournalError(const std::string& call) {
  return {
      v1::ERROR_CODE_INVALID_ARGUMENT,
      call +
          ": this server takes no recordings on request; start it with clothstream-server --recordings DIR"};
}

delivery::SharedBytes recordingNotice(std::uint64_t tick) {
  return delivery::notice(v1::NOTICE_KIND_RECORDING_STARTED, "the scene is being recorded", tick);
}

}  // namespace clothstream::scene
