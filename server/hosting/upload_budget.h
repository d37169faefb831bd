// SPDX-License-Identifier: MIT
// Memory limit of the uploads of all peers together.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <utility>

namespace clothstream::hosting {

// Thread-safe.
class UploadBudget {
 public:
  explicit UploadBudget(std::size_t bytes) : left_(bytes) {}
  // Returns false, and takes nothing, if fewer bytes are left.
  [[nodiscard]] bool take(std::size_t bytes) {
    std::size_t left = left_.load();
    do
      if (left < bytes) return false;
    while (!left_.compare_exchange_weak(left, left - bytes));
    return true;
  }
  void giveBack(std::size_t bytes) { left_ += bytes; }

 private:
  std::atomic<std::size_t> left_;
};

// Bytes taken from a budget; the destructor gives them back.
class UploadReservation {
 public:
  explicit UploadReservation(UploadBudget& budget) : budget_(&budget) {}
  ~UploadReservation() { giveBack(); }
  UploadReservation(UploadReservation&& other) noexcept
      : budget_(other.budget_), bytes_(std::exchange(other.bytes_, 0)) {}
  UploadReservation& operator=(UploadReservation&& other) noexcept {
    giveBack();
    budget_ = other.budget_;
    bytes_ = std::exchange(other.bytes_, 0);
    return *this;
  }

  // Returns false if the budget has fewer bytes left.
  [[nodiscard]] bool grow(std::size_t bytes) {
    if (!budget_->take(bytes)) return false;
    bytes_ += bytes;
    return true;
  }
  void giveBack() { budget_->giveBack(std::exchange(bytes_, 0)); }

 private:
  UploadBudget* budget_;
  std::size_t bytes_ = 0;
};

// A complete upload.
struct UploadedContent {
  std::string bytes;
  UploadReservation reservation;
};

}  // namespace clothstream::hosting
