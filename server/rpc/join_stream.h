// SPDX-License-Identifier: MIT
// One joined stream: moves bytes between gRPC and a stream::Connection.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include <grpcpp/alarm.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "server/stream/connection.h"

namespace clothstream::rpc {

// Thread-safe. gRPC calls the On... functions, one read and one write in flight; pump() may come from
// anywhere.
class JoinStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                         public std::enable_shared_from_this<JoinStream> {
 public:
  // `onDone` is the last thing that the stream does, and may destroy it.
  JoinStream(grpc::CallbackServerContext& context, std::function<void(JoinStream&)> onDone);

  // Once, before gRPC learns of the stream. `wake` must lead to a call of pump(), but not call it itself.
  void open(stream::SceneServer& server, std::function<void()> wake);

  // Writes the next message unless one is being written; ends the stream when there is none left to come.
  void pump();

  // Gives the connection up now, unless it is finished by itself; gRPC hears of the end when what is to be
  // written is. The first one's status holds.
  void finish(const grpc::Status& status);

 private:
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void pumpLocked();
  void finishLocked(const grpc::Status& status);
  void cancelSoonLocked();

  const std::function<void(JoinStream&)> onDone_;
  std::mutex mutex_;
  grpc::CallbackServerContext* const context_;
  std::shared_ptr<stream::Connection> connection_;  // nullptr when the stream is ending
  // Of a client that says no more. Whether it went or was cut off is known when the call is done.
  std::shared_ptr<stream::Connection> parting_;
  bool cutOff_ = false;
  grpc::ByteBuffer incoming_, outgoing_;
  stream::SharedBytes lastMessage_;
  grpc::Status status_;
  bool writing_ = false;
  std::optional<grpc::Alarm> cancellation_;  // set when the write in flight is the last that is waited for
};

}  // namespace clothstream::rpc
