// SPDX-License-Identifier: MIT
// Worker threads that predict large frames.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "proto/codec/workers.h"

namespace clothstream::encode {

// Thread-safe: several callers share the threads.
class EncoderThreads final : public codec::Workers {
 public:
  // `threads` includes the caller's thread and is at least 1. With 1 there is no other thread.
  explicit EncoderThreads(std::uint32_t threads);
  ~EncoderThreads() override;
  EncoderThreads(const EncoderThreads&) = delete;
  EncoderThreads& operator=(const EncoderThreads&) = delete;

  void run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) override;

  // Number of threads for a machine with `processors` processors: a quarter of them, 1 to 8. A software
  // device needs the others.
  static std::uint32_t suitedTo(std::uint32_t processors);

 private:
  struct Pool;
  std::uint32_t others_;
  std::unique_ptr<Pool> pool_;
};

}  // namespace clothstream::encode
