// SPDX-License-Identifier: MIT
#include "server/recording/disk_share.h"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

namespace clothstream::recording {
namespace {

constexpr double kMegabyte = 1e6;
// A file takes at least a block, so that many empty files count too.
constexpr std::uint64_t kBlockBytes = 4096;

}  // namespace

tl::expected<void, std::string> DiskShare::check() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return newest_;
  newest_ = look();
  next_ = now + kInterval;
  return newest_;
}

tl::expected<void, std::string> DiskShare::look() const {
  std::error_code problem;
  const std::filesystem::space_info space = std::filesystem::space(directory_, problem);
  if (!problem && space.available < limits_.minFreeBytes)
    return tl::unexpected(
        fmt::format("the disk of the recordings has {:.0f} MB left, and {:.0f} MB must stay free "
                    "(--keep-free)",
                    static_cast<double>(space.available) / kMegabyte,
                    static_cast<double>(limits_.minFreeBytes) / kMegabyte));
  if (limits_.maxBytes == 0) return {};
  std::uint64_t bytes = 0;
  for (auto file = std::filesystem::directory_iterator(directory_, problem);
       !problem && file != std::filesystem::directory_iterator(); file.increment(problem)) {
    std::error_code gone;
    if (file->path().extension() != ".mcap") continue;
    if (const std::uintmax_t size = file->file_size(gone); !gone) bytes += std::max(size, kBlockBytes);
  }
  if (bytes < limits_.maxBytes) return {};
  return tl::unexpected(fmt::format("the recordings take {:.1f} of {:.1f} MB (--recordings-limit)",
                                    static_cast<double>(bytes) / kMegabyte,
                                    static_cast<double>(limits_.maxBytes) / kMegabyte));
}

}  // namespace clothstream::recording
