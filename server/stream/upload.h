// SPDX-License-Identifier: MIT
// What a peer sends in pieces before it asks for something to be made of it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

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

// A part of the room that is taken, until this is gone.
class TakenRoom {
 public:
  explicit TakenRoom(UploadRoom& room) : room_(&room) {}
  ~TakenRoom() { giveBack(); }
  TakenRoom(TakenRoom&& other) noexcept : room_(other.room_), bytes_(std::exchange(other.bytes_, 0)) {}
  TakenRoom& operator=(TakenRoom&& other) noexcept {
    giveBack();
    room_ = other.room_;
    bytes_ = std::exchange(other.bytes_, 0);
    return *this;
  }

  // False where there is not as much left.
  [[nodiscard]] bool grow(std::size_t bytes) {
    if (!room_->take(bytes)) return false;
    bytes_ += bytes;
    return true;
  }
  void giveBack() { room_->giveBack(std::exchange(bytes_, 0)); }

 private:
  UploadRoom* room_;
  std::size_t bytes_ = 0;
};

// All of a content.
struct UploadedContent {
  std::string bytes;
  TakenRoom room;
};

// Of one peer, one content at a time. Belongs to whoever holds the peer's lock.
class Upload {
 public:
  explicit Upload(UploadRoom& room) : room_(room) {}

  // The next piece, or the first one of another content. What is wrong with it drops what there is.
  [[nodiscard]] messages::Result<void> add(const v1::Chunk& chunk);
  // All of a content, which is gone from here then; or why it is not there.
  [[nodiscard]] messages::Result<UploadedContent> take(std::uint64_t contentId);
  void drop();

 private:
  messages::Result<void> check(const v1::Chunk& chunk) const;

  std::string bytes_;
  TakenRoom room_;
  std::uint64_t contentId_ = 0, totalBytes_ = 0;
  std::uint32_t next_ = 0, count_ = 0;  // pieces
};

}  // namespace clothstream::stream
