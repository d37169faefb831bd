// SPDX-License-Identifier: MIT
// Requests about scenes that the server has not answered yet, and what it answered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/upload.h"
#include "clients/core/wire/scene_request.h"
#include "clients/core/wire/server_message.h"

namespace clothstream::client {

struct Answer {
  std::uint64_t requestId = 0;  // 0 before the first answer
  std::uint32_t request = 0;    // cs_request
  std::uint32_t error = 0;      // ErrorCode; 0 on success
  std::string errorText;
  std::string name;  // scene or file
  std::uint64_t bytes = 0;
  std::string repairs;
};

class Requests {
 public:
  static constexpr std::size_t kMost = 64;

  // Ids are larger than `lastId`.
  explicit Requests(std::uint64_t lastId) : lastId_(lastId) {}

  // Id of the next message, which may be of any kind.
  std::uint64_t nextId() { return ++lastId_; }
  bool isFull() const { return waiting_.size() == kMost; }
  void add(std::uint64_t id, cs_request request) { waiting_.push_back({id, request}); }
  // `request` creates a scene from this content. It is sent after the content, which is not empty and waits
  // until then.
  void upload(std::string content, std::string request, std::uint64_t id);
  // The connection has ended: nothing is answered any more.
  void forget();

  enum class Outcome { unknown, malformed, answered };
  // `unknown`: the client does not wait for this message.
  Outcome answered(const ServerMessage& message);
  // The server refuses what has this id. Nothing is taken from `error` if the outcome is `unknown`.
  Outcome refused(std::uint64_t id, ServerError& error);
  // Whether it was a piece of an upload that the server had refused already.
  bool isOfEndedUpload(std::uint64_t id) const { return id != 0 && id == endedUploadId_; }

  void update(std::uint64_t nowUs) { upload_.update(nowUs); }
  // Id of the newest message, which the next one exceeds.
  std::uint64_t& lastId() { return lastId_; }
  // Message of the upload, or nullptr.
  const std::string* nextOfUpload() { return upload_.next(lastId_); }
  void uploadPongReceived(std::uint64_t id) { upload_.pongReceived(id); }

  const Upload& currentUpload() const { return upload_; }
  // The newest answer.
  const Answer& answer() const { return answer_; }
  const std::string& definition() const { return definition_; }
  const std::vector<Ban>& bans() const { return bans_; }

 private:
  struct Waiting {
    std::uint64_t id;
    cs_request request;
  };

  // Removes and returns the request; nullopt if it does not wait.
  std::optional<cs_request> take(std::uint64_t id);
  // Reads what the answer contains. Returns false if it is malformed.
  bool read(const ServerMessage& message);

  std::uint64_t lastId_;
  std::vector<Waiting> waiting_;
  Upload upload_;
  std::uint64_t endedUploadId_ = 0;  // request of the last upload that the server refused
  Answer answer_;
  std::string definition_;
  std::vector<Ban> bans_;
};

}  // namespace clothstream::client
