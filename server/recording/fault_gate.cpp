// SPDX-License-Identifier: MIT
#include "server/recording/fault_gate.h"

#include <utility>

#include "server/telemetry/log.h"

namespace clothstream::recording {

FaultGate::Passage FaultGate::passageOf(std::uint64_t recordedTick, Clock::time_point now,
                                        const std::string& scene, double time) {
  if (!plan_) return Passage::free;
  if (heldUntil_) {
    if (now < *heldUntil_) return Passage::held;
    heldUntil_.reset();
    return Passage::free;
  }
  const Fault fault = plan_->at(recordedTick);
  if (fault.kind == Fault::Kind::none) return Passage::free;
  if (fault.kind == Fault::Kind::drop) {
    telemetry::log({scene}, spdlog::level::debug, "fault: the frame at {:.3f} s is dropped", time);
    return Passage::dropped;
  }
  telemetry::log({scene}, spdlog::level::debug, "fault: the frame at {:.3f} s waits {} ms", time,
                 fault.wait.count());
  heldSince_ = now;
  heldUntil_ = now + fault.wait;
  return Passage::held;
}

schedule::Clock::time_point FaultGate::takeStart(Clock::time_point now) {
  return std::exchange(heldSince_, std::nullopt).value_or(now);
}

}  // namespace clothstream::recording
