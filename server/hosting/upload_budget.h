// SPDX-License-Identifier: MIT
// Memory limits of uploads: of all peers together, and of the peers of one address.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

namespace clothstream::hosting {

// Thread-safe.
class UploadBudget {
 public:
  // Both in bytes. The second limits one address.
  UploadBudget(std::size_t bytes, std::size_t bytesOfAddress)
      : left_(bytes), bytesOfAddress_(bytesOfAddress) {}
  // Returns false, and takes nothing, if fewer bytes are left. An empty address is only limited by the first
  // number.
  [[nodiscard]] bool take(const std::string& address, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > left_) return false;
    if (!address.empty()) {
      std::size_t& taken = taken_[address];
      if (bytes > bytesOfAddress_ - std::min(taken, bytesOfAddress_)) {
        if (taken == 0) taken_.erase(address);
        return false;
      }
      taken += bytes;
    }
    left_ -= bytes;
    return true;
  }
  void giveBack(const std::string& address, std::size_t bytes) {
    if (bytes == 0) return;
    const std::lock_guard lock(mutex_);
    left_ += bytes;
    const auto entry = taken_.find(address);
    if (entry != taken_.end() && (entry->second -= bytes) == 0) taken_.erase(entry);
  }

 private:
  std::mutex mutex_;
  std::size_t left_;
  const std::size_t bytesOfAddress_;
  std::unordered_map<std::string, std::size_t> taken_;  // of each address, above 0
};

// Bytes taken from a budget; the destructor gives them back.
class UploadReservation {
 public:
  UploadReservation(UploadBudget& budget, std::string address)
      : budget_(&budget), address_(std::make_shared<const std::string>(std::move(address))) {}
  ~UploadReservation() { giveBack(); }
  UploadReservation(UploadReservation&& other) noexcept
      : budget_(other.budget_), address_(other.address_), bytes_(std::exchange(other.bytes_, 0)) {}
  UploadReservation& operator=(UploadReservation&& other) noexcept {
    giveBack();
    budget_ = other.budget_;
    address_ = other.address_;
    bytes_ = std::exchange(other.bytes_, 0);
    return *this;
  }

  // Returns false if the budget has fewer bytes left.
  [[nodiscard]] bool grow(std::size_t bytes) {
    if (!budget_->take(*address_, bytes)) return false;
    bytes_ += bytes;
    return true;
  }
  void giveBack() { budget_->giveBack(*address_, std::exchange(bytes_, 0)); }

 private:
  UploadBudget* budget_;
  std::shared_ptr<const std::string> address_;  // shared, so that a move cannot fail
  std::size_t bytes_ = 0;
};

// A complete upload.
struct UploadedContent {
  std::string bytes;
  UploadReservation reservation;
};

}  // namespace clothstream::hosting
