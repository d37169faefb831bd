// SPDX-License-Identifier: MIT
// The joined streams of a door, and the thread that pumps those that were woken.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <vector>

#include <grpcpp/server_context.h>

#include "server/rpc/join_stream.h"

namespace clothstream::rpc {

// Thread-safe. A wake comes from a thread that makes frames; that one must not write to sockets, so it only
// passes the word to the thread here.
class JoinStreams {
 public:
  JoinStreams(stream::SceneServer& server, std::size_t maxStreams);
  // Every stream must be done.
  ~JoinStreams();
  JoinStreams(const JoinStreams&) = delete;
  JoinStreams& operator=(const JoinStreams&) = delete;

  // The reactor of a new call.
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* open(grpc::CallbackServerContext& context);

  // Finishes all there are, and from here on every new one.
  void finishAll(const grpc::Status& status);

 private:
  void wake(const std::weak_ptr<JoinStream>& stream);
  void pumpWoken();

  stream::SceneServer& server_;
  const std::size_t maxStreams_;

  std::mutex streamsMutex_;
  std::unordered_map<JoinStream*, std::shared_ptr<JoinStream>> streams_;
  grpc::Status refusal_;  // of new streams, unless it is OK

  std::mutex wokenMutex_;
  std::condition_variable wokenOrStopping_;
  std::vector<std::weak_ptr<JoinStream>> woken_;
  bool stopping_ = false;
  std::thread pump_;
};

}  // namespace clothstream::rpc
