// SPDX-License-Identifier: MIT
// Where a reader's bytes come from: a file, or memory.
#pragma once

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
  // Exactly so many bytes, which must lie inside; replaces `out`. False where they cannot be read.
  [[nodiscard]] virtual bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const = 0;
};

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::string bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.assign(bytes_, offset, count);
    return true;
  }

 private:
  std::string bytes_;
};

// As long as it is now. The error names the path and why it cannot be read: pipes and directories cannot.
[[nodiscard]] tl::expected<std::unique_ptr<ByteSource>, std::string> openFile(const std::string& path);

}  // namespace clothstream::recording
