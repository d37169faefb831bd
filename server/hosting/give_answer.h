// SPDX-License-Identifier: MIT
// Answers to requests that arrive also when memory is short.
#pragma once

#include <exception>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/schedule/retry.h"

namespace clothstream::hosting {

// Attempts to give an answer. After these the peer does not get one.
inline constexpr int kAnswerAttempts = 100;

// Calls `done` with the result of `call`. If that throws, for example for a lack of memory, calls it with an
// error instead, until it succeeds or kAnswerAttempts are over. `done` must allow for being called again
// after it has thrown.
template <class Done, class Result>
void giveAnswer(const char* call, const Done& done, Result result) {
  try {
    return done(std::move(result));
  } catch (const std::exception& failure) {
    spdlog::error("{}: the answer is not given: {}; giving an error", call, failure.what());
  }
  for (int attempt = 0; attempt < kAnswerAttempts; ++attempt) {
    std::this_thread::sleep_for(schedule::kRetryPause);
    try {
      v1::Error error;
      error.set_code(v1::ERROR_CODE_RESOURCE_EXHAUSTED);
      error.set_text(
          fmt::format("{}: the server could not give the answer; check whether it took effect", call));
      return done(Result(tl::unexpected(std::move(error))));
    } catch (const std::exception&) {
      continue;
    }
  }
}

}  // namespace clothstream::hosting
