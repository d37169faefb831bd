// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/reflection.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <grpcpp/alarm.h>
#include <grpcpp/support/async_stream.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "server/endpoint/grpc/caller.h"
#include "server/endpoint/grpc/status.h"
#include "server/hosting/answers.h"
#include "server/hosting/scene_server.h"

namespace clothstream::endpoint {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;
using grpc::reflection::v1alpha::ServerReflection;
using grpc::reflection::v1alpha::ServerReflectionRequest;
using grpc::reflection::v1alpha::ServerReflectionResponse;

// Longer requests are no names. They are not answered, because an answer repeats its request.
constexpr std::size_t kMaxRequestBytes = 1024;

std::array<std::string, 3> serviceNames() {
  return {v1::ClothStream::service_full_name(), grpc::health::v1::Health::service_full_name(),
          ServerReflection::service_full_name()};
}

// The file and those that it imports, each once.
void addFiles(const FileDescriptor* file, std::vector<const FileDescriptor*>& files) {
  if (std::ranges::find(files, file) != files.end()) return;
  files.push_back(file);
  for (int i = 0; i < file->dependency_count(); ++i) addFiles(file->dependency(i), files);
}

const std::vector<const FileDescriptor*>& filesOfServices() {
  static const std::vector<const FileDescriptor*> all = [] {
    std::vector<const FileDescriptor*> files;
    for (const std::string& name : serviceNames())
      addFiles(DescriptorPool::generated_pool()->FindServiceByName(name)->file(), files);
    return files;
  }();
  return all;
}

void fail(ServerReflectionResponse& response, grpc::StatusCode code, std::string text) {
  response.mutable_error_response()->set_error_code(code);
  response.mutable_error_response()->set_error_message(std::move(text));
}

// `file` may be null, or a file that has nothing to do with the services.
void describe(const FileDescriptor* file, ServerReflectionResponse& response) {
  if (std::ranges::find(filesOfServices(), file) == filesOfServices().end())
    return fail(response, grpc::StatusCode::NOT_FOUND, "the services have no such file or name");
  std::vector<const FileDescriptor*> files;
  addFiles(file, files);
  for (const FileDescriptor* each : files) {
    google::protobuf::FileDescriptorProto message;
    each->CopyTo(&message);
    response.mutable_file_descriptor_response()->add_file_descriptor_proto(message.SerializeAsString());
  }
}

class ReflectionStream final : public Call {
 public:
  ReflectionStream(GrpcEndpointContext& endpoint, ReflectionService& service)
      : Call(endpoint), service_(service) {}

  void await() {
    context_.AsyncNotifyWhenDone(&ended_);
    service_.RequestServerReflectionInfo(&context_, &io_, &endpoint_.loop->queue(), &endpoint_.loop->queue(),
                                         begin(begun_));
  }

 private:
  void onBegun(bool ok) {
    if (!ok) return over();
    made();
    begin(ended_);
    endpoint::await<ReflectionStream>(endpoint_, service_);
    if (!endpoint_.refusal.ok()) return finish(endpoint_.refusal);
    address_ = addressKeyOf(context_.peer());
    const auto identity = endpoint_.server.authentication.identify(tokenIn(context_), address_.empty());
    if (!identity) return finish(statusOf(hosting::toMessage(identity.error())));
    auto ticket = admit(endpoint_.watches);
    if (!ticket) return finish(ticket.error());
    ticket_.emplace(std::move(*ticket));
    late_.Set(&endpoint_.loop->queue(), std::chrono::system_clock::now() + endpoint_.answerTimeout,
              begin(expired_));
    read();
  }
  void read() { io_.Read(&request_, begin(read_)); }
  void onRead(bool ok) {
    if (hasEnded_ || closing_) return;
    if (!ok) return finish(grpc::Status::OK);
    if (request_.ByteSizeLong() > kMaxRequestBytes)
      return finish({grpc::StatusCode::INVALID_ARGUMENT,
                     fmt::format("a request has at most {} bytes", kMaxRequestBytes)});
    if (!endpoint_.callRate.take(context_.peer(), schedule::Clock::now(), CallRate::kSceneCost))
      return refuse(telemetry::Refusal::callRate, "too many calls: try again in a second");
    const ServerReflectionResponse response = reflectionOf(request_);
    const std::size_t bytes = response.ByteSizeLong();
    if (!endpoint_.answers.take(address_, bytes))
      return refuse(telemetry::Refusal::unreadCalls,
                    "no room next to answers that clients have not read yet: read them, or try again later");
    bytes_ = bytes;
    endpoint_.metrics.grpcBytes.add(bytes);
    io_.Write(response, begin(written_));
  }
  void onWritten(bool ok) {
    endpoint_.answers.release(address_, std::exchange(bytes_, 0));
    if (hasEnded_) return;
    if (closing_) return end();
    if (ok) read();
  }
  void onFinished(bool) {}
  void onExpired(bool expired) {
    if (expired) context_.TryCancel();
  }
  void onEnded(bool) {
    hasEnded_ = true;
    ticket_.reset();
    late_.Cancel();
    over();
  }

  void close(const grpc::Status& status) override { finish(status); }
  void refuse(telemetry::Refusal reason, const char* text) {
    endpoint_.metrics.refuse(reason);
    finish({grpc::StatusCode::RESOURCE_EXHAUSTED, text});
  }
  // Ends the stream after a write that is under way.
  void finish(const grpc::Status& status) {
    if (closing_ || hasEnded_) return;
    closing_ = status;
    if (bytes_ == 0) end();
  }
  void end() { io_.Finish(*closing_, begin(finished_)); }

  ReflectionService& service_;
  ServerReflectionRequest request_;
  grpc::ServerAsyncReaderWriter<ServerReflectionResponse, ServerReflectionRequest> io_{&context_};
  grpc::Alarm late_;
  std::string address_;                      // key of the peer's address
  std::size_t bytes_ = 0;                    // of the answer that is being sent
  std::optional<grpc::Status> closing_;      // set when the stream ends
  std::optional<Admission::Ticket> ticket_;  // none for a refused stream
  bool hasEnded_ = false;
  Step<ReflectionStream> begun_{*this, &ReflectionStream::onBegun}, read_{*this, &ReflectionStream::onRead},
      written_{*this, &ReflectionStream::onWritten}, finished_{*this, &ReflectionStream::onFinished},
      expired_{*this, &ReflectionStream::onExpired}, ended_{*this, &ReflectionStream::onEnded};
};

}  // namespace

ServerReflectionResponse reflectionOf(const ServerReflectionRequest& request) {
  const DescriptorPool& pool = *DescriptorPool::generated_pool();
  ServerReflectionResponse response;
  response.set_valid_host(request.host());
  *response.mutable_original_request() = request;
  switch (request.message_request_case()) {
    case ServerReflectionRequest::kListServices:
      for (const std::string& name : serviceNames())
        response.mutable_list_services_response()->add_service()->set_name(name);
      break;
    case ServerReflectionRequest::kFileByFilename:
      describe(pool.FindFileByName(request.file_by_filename()), response);
      break;
    case ServerReflectionRequest::kFileContainingSymbol:
      describe(pool.FindFileContainingSymbol(request.file_containing_symbol()), response);
      break;
    case ServerReflectionRequest::kFileContainingExtension:
    case ServerReflectionRequest::kAllExtensionNumbersOfType:
      fail(response, grpc::StatusCode::NOT_FOUND, "the services have no extensions");
      break;
    default:
      fail(response, grpc::StatusCode::INVALID_ARGUMENT, "the request asks for nothing that is known");
  }
  return response;
}

void offerReflection(GrpcEndpointContext& endpoint, ReflectionService& service) {
  await<ReflectionStream>(endpoint, service);
}

}  // namespace clothstream::endpoint
