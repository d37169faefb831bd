// SPDX-License-Identifier: MIT
#include "tests/endpoint/rpc_client.h"

#include <utility>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/byte_buffer.h>

namespace clothstream::tests {
namespace {

// Much longer than any answer takes, so that a test that hangs ends.
constexpr std::chrono::seconds kLongestWait{20};

grpc::ByteBuffer bufferOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace

std::shared_ptr<grpc::Channel> channelTo(std::uint16_t port, const RpcOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  if (options.smallWindow) {
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 * 1024);
  }
  return grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials(),
                                   arguments);
}

RpcStream::RpcStream(std::uint16_t port, const RpcOptions& options)
    : RpcStream(channelTo(port, options), options.method, options.compressed) {}

RpcStream::RpcStream(std::shared_ptr<grpc::Channel> channel, const std::string& method, bool compressed)
    : channel_(std::move(channel)) {
  context_.set_wait_for_ready(true);
  if (compressed) context_.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  call_ = grpc::GenericStub(channel_).PrepareCall(&context_, method, &queue_);
  call_->StartCall(this);
  await("start");
}

RpcStream::~RpcStream() {
  context_.TryCancel();
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool RpcStream::await(const char* what) {
  void* tag = nullptr;
  bool ok = false;
  if (queue_.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + kLongestWait) !=
      grpc::CompletionQueue::GOT_EVENT)
    throw std::runtime_error(std::string(what) + ": nothing happened for " +
                             std::to_string(kLongestWait.count()) + " s");
  return ok;
}

bool RpcStream::send(const std::string& message) {
  call_->Write(bufferOf(message), this);
  return await("send");
}

std::optional<std::string> RpcStream::receive() {
  grpc::ByteBuffer buffer;
  call_->Read(&buffer, this);
  if (!await("receive")) return std::nullopt;
  grpc::Slice bytes;
  if (!buffer.DumpToSingleSlice(&bytes).ok()) return std::nullopt;
  return std::string(reinterpret_cast<const char*>(bytes.begin()), bytes.size());
}

StreamEnd RpcStream::end() {
  const grpc::Status status = finish();
  return {status.error_code(), status.error_message()};
}

void RpcStream::awaitAnswer() {
  call_->ReadInitialMetadata(this);
  if (!await("an answer")) throw std::runtime_error("the call ended without an answer");
}

void RpcStream::sendDone() {
  call_->WritesDone(this);
  await("end of sending");
}

grpc::Status RpcStream::finish() {
  grpc::Status status;
  call_->Finish(&status, this);
  await("finish");
  return status;
}

}  // namespace clothstream::tests
