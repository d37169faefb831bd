// SPDX-License-Identifier: MIT
// One Join stream: forwards bytes between gRPC and a session::Session.
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

// At most one read and one write are under way.
class JoinStream final : public Call {
 public:
  JoinStream(GrpcEndpointContext& endpoint, Service& service) : Call(endpoint), service_(service) {}

  void await();

 private:
  void onBegun(bool ok);
  void onRead(bool ok);
  void onWritten(bool ok);
  void onLateForEnd(bool expired);
  void onPaused(bool expired);
  void onFinished(bool) {}
  void onEnded(bool ok);

  void read();
  // Writes the next message unless a write is under way. Ends the stream after the last message.
  void pump();
  // Releases the session and ends the stream after the write that is under way. Only the first call's status
  // counts.
  void finish(const grpc::Status& status);
  void cancelSoon();
  void close(const grpc::Status& status) override;

  Service& service_;
  grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer> io_{&context_};
  std::shared_ptr<session::Session> session_;  // nullptr while the stream closes
  // Session of a client that sends nothing more. The end of the call tells a goodbye from a lost connection.
  std::shared_ptr<session::Session> departing_;
  grpc::ByteBuffer incoming_;
  delivery::SharedBytes lastMessage_;
  std::optional<grpc::Status> closing_;      // set while the stream closes
  std::optional<Admission::Ticket> ticket_;  // none for a refused stream
  bool isWriting_ = false, hasEnded_ = false;
  std::optional<grpc::Alarm> cancellation_;  // set while the stream waits for its last write
  std::optional<grpc::Alarm> pause_;         // before the next read, of a client that sends too fast
  Step<JoinStream> begun_{*this, &JoinStream::onBegun}, read_{*this, &JoinStream::onRead},
      written_{*this, &JoinStream::onWritten}, lateForEnd_{*this, &JoinStream::onLateForEnd},
      finished_{*this, &JoinStream::onFinished}, paused_{*this, &JoinStream::onPaused},
      ended_{*this, &JoinStream::onEnded};
};

}  // namespace clothstream::endpoint
