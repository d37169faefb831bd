// SPDX-License-Identifier: MIT
// Replaces operator new of the program, so that allocations of chosen threads fail on purpose.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace clothstream::tests {

// Names of threads. A thread without a name has that of the thread that created it.
std::string threadName();
void setThreadName(const std::string& name);
// Identifiers of this process's threads of this name.
std::vector<int> threadsNamed(const std::string& name);
// Renames a thread of this process. At most 15 characters.
void renameThread(int id, const std::string& name);

// Gives this thread, and the threads that it creates meanwhile, a name.
class ThreadName {
 public:
  explicit ThreadName(const std::string& name) : before_(threadName()) { setThreadName(name); }
  ~ThreadName() { setThreadName(before_); }
  ThreadName(const ThreadName&) = delete;
  ThreadName& operator=(const ThreadName&) = delete;

 private:
  const std::string before_;
};

// Choice of the allocations of a thread that fail. Those below `leastBytes` succeed and are not counted.
struct Failures {
  std::uint64_t from = 0;   // number of the first allocation that may fail, counted from 0
  std::uint64_t count = 1;  // how many fail at most
  double probability = 1;   // of each one from there on, 0 to 1
  std::uint64_t seed = 1;
  std::size_t leastBytes = 0;
  // No allocation fails after this time, so that a test that waits for the server goes on.
  std::chrono::milliseconds time{150};
};

// While it exists, allocations of the threads of this name throw std::bad_alloc. Allocations inside drivers
// and gRPC succeed, because these end the process without memory. One object exists at a time.
class LackOfMemory {
 public:
  LackOfMemory(const std::string& thread, const Failures& failures);
  ~LackOfMemory();
  LackOfMemory(const LackOfMemory&) = delete;
  LackOfMemory& operator=(const LackOfMemory&) = delete;

  // Allocations that have failed.
  std::uint64_t failed() const;
  // Whether no more allocations fail.
  bool isOver() const;
};

// Calls `work` with what `prepare` returns, and lets allocations in `work` fail: the first one, then only the
// second one, and so on until all succeed. `count` of them fail in a row. `check` gets the object each time.
// Only the calling thread runs short of memory. Returns how many allocations `work` makes.
template <class Prepare, class Work, class Check>
std::uint64_t failEachAllocation(std::uint64_t count, const Prepare& prepare, const Work& work,
                                 const Check& check) {
  for (std::uint64_t from = 0;; ++from) {
    auto object = prepare();
    bool failed = false;
    {
      const ThreadName name("failing");
      const LackOfMemory lack("failing", {.from = from, .count = count, .time = std::chrono::hours(1)});
      try {
        work(object);
      } catch (const std::bad_alloc&) {
      }
      failed = lack.failed() > 0;
    }
    check(object);
    if (!failed) return from;
  }
}

}  // namespace clothstream::tests
