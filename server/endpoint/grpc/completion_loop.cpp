// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/completion_loop.h"

#include <exception>
#include <utility>

#include <grpc/support/time.h>
#include <spdlog/spdlog.h>

namespace clothstream::endpoint {
namespace {

// An exception, such as for a lack of memory, ends the operation of one call and not the endpoint.
void survive(const auto& work) {
  try {
    work();
  } catch (const std::exception& failure) {
    spdlog::error("gRPC: {}", failure.what());
  }
}

}  // namespace

CompletionLoop::CompletionLoop(std::unique_ptr<grpc::ServerCompletionQueue> queue)
    : queue_(std::move(queue)) {}

void CompletionLoop::start() {
  thread_ = std::thread([this] {
    void* tag = nullptr;
    bool ok = false;
    while (queue_->Next(&tag, &ok)) survive([&] { static_cast<Operation*>(tag)->done(ok); });
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
  for (const auto& task : tasks) survive(task);
}

}  // namespace clothstream::endpoint
