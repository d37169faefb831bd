// SPDX-License-Identifier: MIT
// Worker threads that predict large frames, and work on the ticks of many scenes.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "proto/codec/workers.h"

namespace clothstream::encode {

// Thread-safe: several callers share the threads. A call waits for no other call: its own thread works, too,
// and the others help when they have time. Allocates no memory once as many calls were made at the same time.
class WorkerThreads final : public codec::Workers {
 public:
  // `threads` includes the caller's thread and is at least 1. With 1 there is no other thread.
  explicit WorkerThreads(std::uint32_t threads);
  ~WorkerThreads() override;
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;

  void run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) override;

  // Number of threads for a machine with `processors` processors: a quarter of them, 1 to 8. A software
  // device needs the others.
  static std::uint32_t suitedTo(std::uint32_t processors);

 private:
  struct Call {
    const std::function<void(std::uint32_t)>& piece;
    const std::uint32_t pieces;
    std::atomic<std::uint32_t> next = 0;  // piece that begins next
    std::uint32_t helpers = 0;            // threads that work on it, other than the caller's

    void work() {
      for (std::uint32_t i = next++; i < pieces; i = next++) piece(i);
    }
  };

  void help();
  void stop();

  std::mutex mutex_;  // protects the following, and Call::helpers
  std::condition_variable called_, helped_;
  std::vector<Call*> calls_;  // with pieces that have not begun, as far as is known
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace clothstream::encode
