// SPDX-License-Identifier: MIT
// Owner of a file descriptor.
#pragma once

#include <utility>

#include <unistd.h>

namespace clothstream::link {

class Descriptor {
 public:
  // Takes the ownership; negative: nothing is open.
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }

  int operator*() const { return number_; }

 private:
  int number_;
};

}  // namespace clothstream::link
