// SPDX-License-Identifier: MIT
// Source of a reader's bytes: a file or memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::recording {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  // Reads exactly `count` bytes, which must lie inside the source, and replaces `out`. False if they cannot
  // be read.
  [[nodiscard]] virtual bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const = 0;
};

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.assign(bytes_, static_cast<std::size_t>(offset), static_cast<std::size_t>(count));
    return true;
  }

 private:
  std::string bytes_;
};

// Opens a regular file with its present size. The error names the path and the reason; pipes and directories
// are refused.
[[nodiscard]] tl::expected<std::unique_ptr<ByteSource>, std::string> openFile(const std::string& path);

}  // namespace clothstream::recording
