// SPDX-License-Identifier: MIT
// All targets, for the program that replays their inputs.
#include "tests/fuzz/targets/core_target.h"
#include "tests/fuzz/targets/datagram_target.h"
#include "tests/fuzz/targets/decoder_target.h"
#include "tests/fuzz/targets/draco_target.h"
#include "tests/fuzz/targets/dtls_target.h"
#include "tests/fuzz/targets/files_target.h"
#include "tests/fuzz/targets/gltf_target.h"
#include "tests/fuzz/targets/http_target.h"
#include "tests/fuzz/targets/hull_target.h"
#include "tests/fuzz/targets/obj_target.h"
#include "tests/fuzz/targets/pieces_target.h"
#include "tests/fuzz/targets/recording_target.h"
#include "tests/fuzz/targets/saved_state_target.h"
#include "tests/fuzz/targets/scene_json_target.h"
#include "tests/fuzz/targets/scene_target.h"
#include "tests/fuzz/targets/sctp_target.h"
#include "tests/fuzz/targets/session_target.h"
#include "tests/fuzz/targets/stun_target.h"
#include "tests/fuzz/targets/token_target.h"

namespace clothstream::fuzz {

std::span<const Target* const> targets() {
  static constexpr const Target* kAll[]{
      &kCoreTarget,   &kDatagramTarget,  &kDecoderTarget,    &kDracoTarget, &kDtlsTarget,
      &kFilesTarget,  &kGltfTarget,      &kHttpTarget,       &kHullTarget,  &kObjTarget,
      &kPiecesTarget, &kRecordingTarget, &kSavedStateTarget, &kSceneTarget, &kSceneJsonTarget,
      &kSctpTarget,   &kSessionTarget,   &kStunTarget,       &kTokenTarget};
  return kAll;
}

}  // namespace clothstream::fuzz
