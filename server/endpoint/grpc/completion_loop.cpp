// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/completion_loop.h"

#include <utility>

#include <grpc/support/time.h>

#include "server/telemetry/thread_name.h"

namespace clothstream::endpoint {

CompletionLoop::CompletionLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue)
    : queue_(std::move(queue)) {}

void CompletionLoop::start() {
  thread_ = std::thread([this] {
    telemetry::nameThread("grpc");
    void* tag = nullptr;
    bool ok = false;
    while (queue_->Next(&tag, &ok)) static_cast<Operation*>(tag)->done(ok);
  });
}

void CompletionLoop::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(stopped_, true)) return;
    tasks_.clear();
  }
  queue_->Shutdown();
  if (!thread_.joinable()) start();  // the queue must be drained before its destruction
  thread_.join();
}

void CompletionLoop::post(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  if (stopped_) return;
  tasks_.push_back(std::move(task));
  if (std::exchange(waking_, true)) return;
  alarm_.Set(queue_.get(), gpr_inf_past(GPR_CLOCK_MONOTONIC), &wakeup_);
}

void CompletionLoop::runTasks() {
  std::vector<std::function<void()>> tasks;
  {
    const std::lock_guard lock(mutex_);
    waking_ = false;
    std::swap(tasks, tasks_);
  }
  for (const auto& task : tasks) task();
}

}  // namespace clothstream::endpoint
