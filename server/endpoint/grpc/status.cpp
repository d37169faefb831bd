// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/status.h"

namespace clothstream::endpoint {
namespace {

grpc::StatusCode codeOf(v1::ErrorCode code) {
  switch (code) {
    case v1::ERROR_CODE_MALFORMED_MESSAGE:
    case v1::ERROR_CODE_INVALID_ARGUMENT:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case v1::ERROR_CODE_NOT_FOUND:
      return grpc::StatusCode::NOT_FOUND;
    case v1::ERROR_CODE_UNSUPPORTED_VERSION:
    case v1::ERROR_CODE_UNSUPPORTED_CODEC:
      return grpc::StatusCode::UNIMPLEMENTED;
    case v1::ERROR_CODE_RATE_LIMITED:
    case v1::ERROR_CODE_RESOURCE_EXHAUSTED:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case v1::ERROR_CODE_OUT_OF_ORDER:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case v1::ERROR_CODE_PERMISSION_DENIED:
    case v1::ERROR_CODE_REMOVED:
      return grpc::StatusCode::PERMISSION_DENIED;
    case v1::ERROR_CODE_UNAUTHENTICATED:
    case v1::ERROR_CODE_WRONG_PAIRING_CODE:
      return grpc::StatusCode::UNAUTHENTICATED;
    case v1::ERROR_CODE_CUT_OFF:
      return grpc::StatusCode::UNAVAILABLE;
    case v1::ERROR_CODE_TAKEN_OVER:
      return grpc::StatusCode::ABORTED;
    default:
      return grpc::StatusCode::UNKNOWN;
  }
}

}  // namespace

grpc::Status statusOf(const v1::Error& error) {
  return {codeOf(error.code()), error.text()};
}

grpc::Status statusOf(telemetry::Refusal reason) {
  constexpr auto kCode = grpc::StatusCode::RESOURCE_EXHAUSTED;
  switch (reason) {
    case telemetry::Refusal::connectionsOfAddress:
      return {kCode, "too many streams of this address are open (--profile): close others first"};
    case telemetry::Refusal::connectionRateOfAddress:
      return {kCode, "too many new streams of this address (--profile): try again in a second"};
    case telemetry::Refusal::connectionRate:
      return {kCode, "too many new streams (--profile): try again in a second"};
    default:
      return {kCode, "the server has no free stream; try again later"};
  }
}

grpc::Status statusOf(const session::Closing& closing) {
  switch (closing.reason) {
    case session::Closing::Reason::error:
      return statusOf(closing.error);
    case session::Closing::Reason::sceneDeleted:
      return {grpc::StatusCode::NOT_FOUND, closing.text};
    case session::Closing::Reason::serverStopping:
      break;
  }
  return {grpc::StatusCode::UNAVAILABLE, closing.text};
}

}  // namespace clothstream::endpoint
