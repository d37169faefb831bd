// SPDX-License-Identifier: MIT
#include "server/telemetry/trace.h"

#include <algorithm>

namespace clothstream::telemetry {

void Trace::add(const TraceSpan& span) {
  const std::lock_guard lock(mutex_);
  spans_[count_++ % kSpans] = span;
}

std::vector<TraceSpan> Trace::since(std::chrono::steady_clock::time_point begin) const {
  std::vector<TraceSpan> spans;
  const std::lock_guard lock(mutex_);
  for (std::size_t i = count_ - std::min(count_, kSpans); i < count_; ++i)
    if (const TraceSpan& span = spans_[i % kSpans]; span.start + span.length >= begin) spans.push_back(span);
  return spans;
}

}  // namespace clothstream::telemetry
