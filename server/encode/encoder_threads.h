// SPDX-License-Identifier: MIT
// Threads that predict large frames together.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "proto/codec/workers.h"

namespace clothstream::encode {

// Thread-safe: several callers share the threads.
class EncoderThreads final : public codec::Workers {
 public:
  // `threads` with the caller's own, at least 1; then there is no other.
  explicit EncoderThreads(std::uint32_t threads);
  ~EncoderThreads() override;
  EncoderThreads(const EncoderThreads&) = delete;
  EncoderThreads& operator=(const EncoderThreads&) = delete;

  void run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) override;

  // Of a machine with so many processors: a quarter, 1 to 8. A software device wants the others.
  static std::uint32_t suitedTo(std::uint32_t processors);

 private:
  struct Pool;
  std::uint32_t others_;
  std::unique_ptr<Pool> pool_;
};

}  // namespace clothstream::encode
