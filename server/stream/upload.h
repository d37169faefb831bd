// SPDX-License-Identifier: MIT
// What a peer sends in pieces before it asks for something to be made of it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"

namespace clothstream::stream {

// Room for what all peers of a server upload at the same time. Thread-safe.
class UploadRoom {
 public:
  explicit UploadRoom(std::size_t bytes) : left_(bytes) {}
  // False where there is not as much left.
  [[nodiscard]] bool take(std::size_t bytes);
  void giveBack(std::size_t bytes) { left_ += bytes; }

 private:
  std::atomic<std::size_t> left_;
};

// Of one peer, one content at a time. Belongs to whoever holds the peer's lock.
class Upload {
 public:
  explicit Upload(UploadRoom& room) : room_(room) {}
  ~Upload() { drop(); }
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  // The next piece, or the first one of another content. What is wrong with it drops what there is.
  [[nodiscard]] messages::Result<void> add(const v1::Chunk& chunk);
  // All of a content, which is gone from here then; or why it is not there.
  [[nodiscard]] messages::Result<std::string> take(std::uint64_t contentId);
  void drop();

 private:
  messages::Result<void> check(const v1::Chunk& chunk) const;

  UploadRoom& room_;
  std::string bytes_;
  std::size_t taken_ = 0;  // of the room
  std::uint64_t contentId_ = 0, totalBytes_ = 0;
  std::uint32_t next_ = 0, count_ = 0;  // pieces
};

}  // namespace clothstream::stream
