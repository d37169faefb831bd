// SPDX-License-Identifier: MIT
#include "server/session/upload.h"

#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/server_options.h"
#include "server/messages/limits.h"

namespace clothstream::session {

messages::Result<void> Upload::check(const v1::Chunk& chunk) const {
  const auto invalid = [](std::string text) {
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT, std::move(text)});
  };
  if (chunk.kind() != v1::CONTENT_KIND_SCENE)
    return invalid(
        fmt::format("upload.kind = {}: must be CONTENT_KIND_SCENE", static_cast<int>(chunk.kind())));
  if (chunk.total_bytes() > messages::limits::kMaxContentBytes)
    return invalid(fmt::format("upload.totalBytes = {}: must be at most {}", chunk.total_bytes(),
                               messages::limits::kMaxContentBytes));
  if (chunk.index() >= chunk.count())
    return invalid(fmt::format("upload.index = {}: must be below upload.count, which is {}", chunk.index(),
                               chunk.count()));
  if (chunk.index() != next_ || (next_ > 0 && (chunk.content_id() != contentId_ || chunk.count() != count_ ||
                                               chunk.total_bytes() != totalBytes_)))
    return invalid(
        fmt::format("upload.index = {} of content {}: must be 0, or chunk {} of content {} with the "
                    "count and totalBytes of its first",
                    chunk.index(), chunk.content_id(), next_, contentId_));
  const std::uint64_t bytes = bytes_.size() + chunk.data().size();
  const bool last = chunk.index() + 1 == chunk.count();
  if (last ? bytes != chunk.total_bytes() : bytes > chunk.total_bytes())
    return invalid(
        fmt::format("upload.data: {} bytes in all; upload.totalBytes is {}", bytes, chunk.total_bytes()));
  return {};
}

messages::Result<void> Upload::add(const v1::Chunk& chunk, schedule::Clock::time_point now) {
  if (chunk.index() == 0) {
    drop();
    begun_ = now;
  }
  if (auto checked = check(chunk); !checked) {
    drop();
    return checked;
  }
  if (!reservation_.grow(chunk.data().size())) {
    drop();
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        "upload: the server has no memory left for uploads (--max-upload-memory), or none for "
        "this address (--profile); try again later",
        telemetry::Refusal::uploads});
  }
  contentId_ = chunk.content_id();
  totalBytes_ = chunk.total_bytes();
  count_ = chunk.count();
  ++next_;
  bytes_ += chunk.data();
  return {};
}

messages::Result<void> Upload::checkPace(const UploadPace& pace, schedule::Clock::time_point now) {
  if (next_ == 0) return {};
  const schedule::Clock::duration time = now - begun_;
  const auto refuse = [&](std::string text) {
    drop();
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED, std::move(text),
                                               telemetry::Refusal::uploadTime});
  };
  if (time > pace.maxTime)
    return refuse(
        fmt::format("upload: no scene was created from it within {} s (--profile), so it was "
                    "dropped; start again",
                    schedule::seconds(pace.maxTime)));
  const double least = pace.minBytesPerSecond * schedule::seconds(time - hosting::kUploadPatience);
  if (next_ < count_ && static_cast<double>(bytes_.size()) < least)
    return refuse(
        fmt::format("upload: {} bytes in {:.1f} s are slower than {:.0f} bytes a second (--profile), "
                    "so it was dropped",
                    bytes_.size(), schedule::seconds(time), pace.minBytesPerSecond));
  return {};
}

messages::Result<hosting::UploadedContent> Upload::take(std::uint64_t contentId) {
  if (next_ == 0 || contentId != contentId_ || next_ != count_)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_NOT_FOUND,
        fmt::format("createScene.uploadedContentId = {}: this stream has not uploaded it completely",
                    contentId)});
  hosting::UploadedContent content{std::move(bytes_), std::move(reservation_)};
  drop();
  return content;
}

void Upload::drop() {
  reservation_.giveBack();
  bytes_ = {};
  next_ = count_ = 0;
}

}  // namespace clothstream::session
