// SPDX-License-Identifier: MIT
// Wakes of a session whose endpoint works on one thread.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <utility>

namespace clothstream::session {

// The `wake` of Session::open(). `post` runs a function on the endpoint's thread; there `pump` gets the
// stream and writes what its session has. At most one pump waits at a time.
//
// A wake may come from any thread, so it does not own the stream. Dropping the last owner inside a wake would
// deadlock: the release of the session waits for that wake to return.
template <typename Stream, typename Post, typename Pump>
std::function<void()> wakeOf(std::weak_ptr<Stream> stream, Post post, Pump pump) {
  return [stream = std::move(stream), post = std::move(post), pump = std::move(pump),
          posted = std::make_shared<std::atomic<bool>>(false)] {
    if (posted->exchange(true)) return;
    post([stream, pump, posted] {
      posted->store(false);
      if (const std::shared_ptr<Stream> self = stream.lock()) pump(*self);
    });
  };
}

}  // namespace clothstream::session
