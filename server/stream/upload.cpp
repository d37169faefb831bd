// SPDX-License-Identifier: MIT
// Contents from peers.
#include "server/stream/upload.h"

#include <utility>

#include <fmt/format.h>

#include "server/messages/limits.h"

namespace clothstream::stream {

bool UploadRoom::take(std::size_t bytes) {
  std::size_t left = left_.load();
  do
    if (left < bytes) return false;
  while (!left_.compare_exchange_weak(left, left - bytes));
  return true;
}

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
        fmt::format("upload.index = {} of content {}: must be 0, or piece {} of content {} with the "
                    "count and totalBytes of its first",
                    chunk.index(), chunk.content_id(), next_, contentId_));
  const std::uint64_t bytes = bytes_.size() + chunk.data().size();
  const bool last = chunk.index() + 1 == chunk.count();
  if (last ? bytes != chunk.total_bytes() : bytes > chunk.total_bytes())
    return invalid(fmt::format("upload.data: makes {} bytes of the {} that upload.totalBytes says", bytes,
                               chunk.total_bytes()));
  return {};
}

messages::Result<void> Upload::add(const v1::Chunk& chunk) {
  if (chunk.index() == 0) drop();
  if (auto checked = check(chunk); !checked) {
    drop();
    return checked;
  }
  if (!room_.grow(chunk.data().size())) {
    drop();
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                               "upload: the server has no room for it now; try again later"});
  }
  contentId_ = chunk.content_id();
  totalBytes_ = chunk.total_bytes();
  count_ = chunk.count();
  ++next_;
  bytes_ += chunk.data();
  return {};
}

messages::Result<UploadedContent> Upload::take(std::uint64_t contentId) {
  if (next_ == 0 || contentId != contentId_ || next_ != count_)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_NOT_FOUND,
        fmt::format("createScene.uploadedContentId = {}: this stream has not uploaded all of it",
                    contentId)});
  UploadedContent content{std::move(bytes_), std::move(room_)};
  drop();
  return content;
}

void Upload::drop() {
  room_.giveBack();
  bytes_ = {};
  next_ = count_ = 0;
}

}  // namespace clothstream::stream
