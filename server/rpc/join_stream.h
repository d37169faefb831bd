// SPDX-License-Identifier: MIT
// One joined stream: moves bytes between gRPC and a stream::Connection.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "server/stream/connection.h"

namespace clothstream::rpc {

// Thread-safe. gRPC calls the On... functions, one read and one write in flight; pump() may come from
// anywhere.
class JoinStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // `onDone` is the last thing that the stream does, and may destroy it.
  explicit JoinStream(std::function<void(JoinStream&)> onDone);

  // Once, before gRPC learns of the stream. `wake` must lead to a call of pump(), but not call it itself.
  void open(stream::SceneServer& server, std::string peer, std::function<void()> wake);

  // Writes the next message unless one is being written; ends the stream when there is none left to come.
  void pump();

  // Leaves the scene now; gRPC hears of the end when the write in flight is done. The first one's status
  // holds.
  void finish(const grpc::Status& status);

 private:
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void pumpLocked();
  void finishLocked(const grpc::Status& status);

  const std::function<void(JoinStream&)> onDone_;
  std::mutex mutex_;
  std::shared_ptr<stream::Connection> connection_;  // nullptr when the stream is ending
  grpc::ByteBuffer incoming_, outgoing_;
  stream::SharedBytes lastMessage_;
  grpc::Status status_;
  bool writing_ = false;
};

}  // namespace clothstream::rpc
