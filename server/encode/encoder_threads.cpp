// SPDX-License-Identifier: MIT
#include "server/encode/encoder_threads.h"

#include <algorithm>
#include <atomic>
#include <latch>

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

namespace clothstream::encode {

struct EncoderThreads::Pool {
  explicit Pool(std::uint32_t count) : threads(count) {}
  boost::asio::thread_pool threads;
};

EncoderThreads::EncoderThreads(std::uint32_t threads)
    : others_(std::max(threads, 1u) - 1), pool_(others_ > 0 ? std::make_unique<Pool>(others_) : nullptr) {}

EncoderThreads::~EncoderThreads() {
  if (pool_) pool_->threads.join();
}

void EncoderThreads::run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) {
  const std::uint32_t helpers = std::min(others_, std::max(pieces, 1u) - 1);
  std::atomic<std::uint32_t> next = 0;
  std::latch helped(helpers);
  const auto help = [&] {
    for (std::uint32_t i = next++; i < pieces; i = next++) piece(i);
  };
  for (std::uint32_t i = 0; i < helpers; ++i)
    boost::asio::post(pool_->threads, [&] {
      help();
      helped.count_down();
    });
  help();
  helped.wait();
}

std::uint32_t EncoderThreads::suitedTo(std::uint32_t processors) {
  return std::clamp(processors / 4, 1u, 8u);
}

}  // namespace clothstream::encode
