// SPDX-License-Identifier: MIT
// One joined stream: moves bytes between gRPC and a session::Session.
#pragma once

#include <memory>
#include <optional>

#include <grpcpp/alarm.h>
#include <grpcpp/support/async_stream.h>
#include <grpcpp/support/byte_buffer.h>

#include "server/endpoint/grpc/call.h"
#include "server/endpoint/grpc/service.h"
#include "server/session/session.h"

namespace clothstream::endpoint {

// One read and one write under way at most.
class JoinStream final : public Call {
 public:
  JoinStream(EndpointContext& endpoint, Service& service) : Call(endpoint), service_(service) {}

  void await();

 private:
  void onBegun(bool ok);
  void onRead(bool ok);
  void onWritten(bool ok);
  void onLateForEnd(bool expired);
  void onFinished(bool) {}
  void onEnded(bool ok);

  void read();
  // Writes the next message unless one is being written; ends the stream when there is none left to come.
  void pump();
  // Gives the connection up; gRPC hears of the end when what is being written is. The first one's status
  // holds.
  void finish(const grpc::Status& status);
  void cancelSoon();
  void close(const grpc::Status& status) override;

  Service& service_;
  grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer> io_{&context_};
  std::shared_ptr<session::Session> connection_;  // nullptr when the stream is closing
  // Of a client that says no more. Whether it went or was cut off is known when the call has ended.
  std::shared_ptr<session::Session> parting_;
  grpc::ByteBuffer incoming_;
  delivery::SharedBytes lastMessage_;
  std::optional<grpc::Status> closing_;  // set when it is
  bool isCounted_ = false, isWriting_ = false, hasEnded_ = false;
  std::optional<grpc::Alarm> cancellation_;  // set when the write under way is the last that is waited for
  Step<JoinStream> begun_{*this, &JoinStream::onBegun}, read_{*this, &JoinStream::onRead},
      written_{*this, &JoinStream::onWritten}, lateForEnd_{*this, &JoinStream::onLateForEnd},
      finished_{*this, &JoinStream::onFinished}, ended_{*this, &JoinStream::onEnded};
};

}  // namespace clothstream::endpoint
