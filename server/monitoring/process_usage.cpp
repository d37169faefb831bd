// SPDX-License-Identifier: MIT
#include "server/monitoring/process_usage.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace clothstream::monitoring {
namespace {

// Number of entries of a directory; 0 if it cannot be read.
std::uint64_t entriesOf(const char* directory) {
  std::error_code error;
  std::uint64_t count = 0;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error))
    ++count;
  return count;
}

}  // namespace

ProcessUsage processUsage() {
  ProcessUsage usage{.threads = entriesOf("/proc/self/task")};
  // The directory that is read is open, too.
  const std::uint64_t descriptors = entriesOf("/proc/self/fd");
  usage.openDescriptors = descriptors > 0 ? descriptors - 1 : 0;
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmRSS:") continue;
    std::uint64_t kibibytes = 0;
    if (status >> kibibytes) usage.residentBytes = kibibytes * 1024;
    break;
  }
  return usage;
}

}  // namespace clothstream::monitoring
