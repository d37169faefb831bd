// SPDX-License-Identifier: MIT
// Array whose allocation can fail without an exception.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace clothstream::codec {

// Elements are not initialised.
template <typename T>
class Array {
 public:
  [[nodiscard]] bool allocate(std::size_t size) {
    values_.reset(new (std::nothrow) T[size]);
    size_ = values_ == nullptr ? 0 : size;
    return values_ != nullptr;
  }
  T* data() const { return values_.get(); }
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) const { return values_[i]; }
  T* begin() const { return values_.get(); }
  T* end() const { return values_.get() + size_; }

 private:
  std::unique_ptr<T[]> values_;
  std::size_t size_ = 0;
};

}  // namespace clothstream::codec
