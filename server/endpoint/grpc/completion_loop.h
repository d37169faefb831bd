// SPDX-License-Identifier: MIT
// gRPC's completion queue and the one thread that serves it.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>

namespace clothstream::endpoint {

// Handler of a completed gRPC operation. Its address is the tag.
class Operation {
 public:
  // `ok` comes from gRPC. May destroy the operation.
  virtual void done(bool ok) = 0;

 protected:
  ~Operation() = default;
};

// Runs all operations on one thread, one after the other. One thread is faster than gRPC's own pool, whose
// threads hand events to each other (docs/benchmarks.md).
class CompletionLoop {
 public:
  // Runs nothing before start().
  explicit CompletionLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue);
  ~CompletionLoop() { stop(); }
  CompletionLoop(const CompletionLoop&) = delete;
  CompletionLoop& operator=(const CompletionLoop&) = delete;

  grpc::ServerCompletionQueue& queue() { return *queue_; }

  void start();
  // Returns when all operations are done. No operation may begin afterwards. Call it on the thread that
  // called start().
  void stop();

  // Runs the task on the loop's thread. Drops it after stop(). Thread-safe.
  void post(std::function<void()> task);

 private:
  struct Wakeup final : Operation {
    explicit Wakeup(CompletionLoop& owner) : loop(owner) {}
    void done(bool) override { loop.runTasks(); }
    CompletionLoop& loop;
  };

  void runTasks();

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::mutex mutex_;
  std::vector<std::function<void()>> tasks_;
  bool waking_ = false;
  bool stopped_ = false;
  grpc::Alarm alarm_;
  Wakeup wakeup_{*this};
  std::thread thread_;
};

}  // namespace clothstream::endpoint
