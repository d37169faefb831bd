// SPDX-License-Identifier: MIT
// Sends a content to the server in pieces, a few at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace clothstream::client {

// A window of pieces ends with a ping. Messages arrive in order, so its pong says that the server has the
// window, and the next one may follow. Acknowledgements of frames thus never wait behind the whole content.
class Upload {
 public:
  static constexpr std::size_t kPieceBytes = 60 * 1024;  // a message has at most 64 KiB
  static constexpr std::uint32_t kWindow = 4;            // pieces
  static constexpr std::uint64_t kWindowUs = 100'000;    // minimum, because the server limits pings
  static constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

  // `request` is sent after the last piece; it names the content `requestId`. `content` is not empty.
  void begin(std::string content, std::string request, std::uint64_t requestId);
  void end() { *this = {}; }
  bool isActive() const { return !content_.empty(); }
  std::uint64_t requestId() const { return requestId_; }
  // Bytes that the server has, and all bytes.
  std::uint64_t sent() const { return sent_; }
  std::uint64_t bytes() const { return content_.size(); }

  // Opens the next window if it may follow.
  void update(std::uint64_t nowUs);
  // Returns the next message, or nullptr. It counts `lastRequestId` up for a ping.
  const std::string* next(std::uint64_t& lastRequestId);
  // Does nothing if the ping was not of this upload. These pings have the client time 0.
  void pongReceived(std::uint64_t requestId);

 private:
  std::string content_, request_, message_;
  std::uint64_t requestId_ = 0;
  std::uint32_t nextPiece_ = 0, windowEnd_ = 0;
  std::uint64_t sent_ = 0, openedUs_ = 0;
  std::uint64_t pingId_ = 0;  // ping that was sent and has no answer; 0: none
  bool pings_ = false;        // a ping ends the window and is not sent yet
  bool isRequested_ = false;  // the request is sent
};

}  // namespace clothstream::client
