// SPDX-License-Identifier: MIT
// gRPC's completion queue and the one thread that works on it.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>

namespace clothstream::endpoint {

// What is to happen when gRPC is done with something: its address is the tag.
class Operation {
 public:
  // `ok` is gRPC's. May destroy the operation.
  virtual void done(bool ok) = 0;

 protected:
  ~Operation() = default;
};

// All operations are done on the loop's thread, one after the other. There is one thread, not gRPC's own few,
// because those hand each other what they find (docs/benchmarks.md).
class CompletionLoop {
 public:
  // Nothing runs before start().
  explicit CompletionLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue);
  ~CompletionLoop() { stop(); }
  CompletionLoop(const CompletionLoop&) = delete;
  CompletionLoop& operator=(const CompletionLoop&) = delete;

  grpc::ServerCompletionQueue& queue() { return *queue_; }

  void start();
  // Returns when all operations are done; none may be begun from here on. Belongs to the thread that started.
  void stop();

  // From any thread: runs the task on the loop's. One that comes after stop() is dropped.
  void post(std::function<void()> task);

 private:
  struct Woken final : Operation {
    explicit Woken(CompletionLoop& its) : loop(its) {}
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
  Woken woken_{*this};
  std::thread thread_;
};

}  // namespace clothstream::endpoint
