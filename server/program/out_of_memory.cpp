// SPDX-License-Identifier: MIT
#include "server/program/out_of_memory.h"

#include <array>
#include <cstdlib>
#include <new>
#include <string_view>

#include <sys/uio.h>
#include <unistd.h>

namespace clothstream::program {
namespace {

constexpr std::string_view kMessage =
    "memory ran out, so the server ends with status 71. A new start with the same --state-dir brings the "
    "scenes back. These options bound memory: --max-memory, --max-created-scenes, --max-participants, "
    "--max-connections, --max-upload-memory and --profile (docs/limits.md)";
static_assert(kOutOfMemoryStatus == 71);

iovec partOf(std::string_view text) {
  return {.iov_base = const_cast<char*>(text.data()), .iov_len = text.size()};
}

// Neither call allocates memory or takes a lock: any thread may hold the locks of the log.
[[noreturn]] void endWith(std::string_view before, std::string_view after) {
  const std::array parts{partOf(before), partOf(kMessage), partOf(after)};
  // The process ends, whether the line can be written or not.
  [[maybe_unused]] const auto written = ::writev(STDERR_FILENO, parts.data(), static_cast<int>(parts.size()));
  std::_Exit(kOutOfMemoryStatus);
}

void endWithText() {
  endWith("critical ", "\n");
}

void endWithJson() {
  endWith(R"({"level":"critical","message":")", "\"}\n");
}

}  // namespace

void endWhenOutOfMemory(const LogOptions& log) {
  std::set_new_handler(log.format == "json" ? endWithJson : endWithText);
}

}  // namespace clothstream::program
