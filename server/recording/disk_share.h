// SPDX-License-Identifier: MIT
// Share of the disk that recordings may take.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::recording {

struct DiskLimits {
  std::uint64_t maxBytes = 0;      // of all recordings in the directory; 0: no limit
  std::uint64_t minFreeBytes = 0;  // of the file system
};

// Thread-safe.
class DiskShare {
 public:
  DiskShare(std::filesystem::path directory, const DiskLimits& limits)
      : directory_(std::move(directory)), limits_(limits) {}

  // Returns an error that names size, limit and option if nothing more may be written. Looks at the disk at
  // most once per kInterval.
  tl::expected<void, std::string> check();

  static constexpr std::chrono::milliseconds kInterval{500};

 private:
  tl::expected<void, std::string> look() const;

  const std::filesystem::path directory_;
  const DiskLimits limits_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point next_{};  // earliest time of the next look
  tl::expected<void, std::string> newest_;
};

}  // namespace clothstream::recording
