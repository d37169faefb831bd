// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/answer_budget.h"

namespace clothstream::endpoint {
namespace {

bool hasRoom(std::size_t used, std::size_t bytes, std::size_t limit) {
  return used == 0 || (bytes <= limit && used <= limit - bytes);
}

}  // namespace

bool AnswerBudget::take(const std::string& key, std::size_t bytes) {
  if (bytes == 0) return true;
  const auto entry = key.empty() ? ofAddress_.end() : ofAddress_.find(key);
  const std::size_t usedByAddress = entry == ofAddress_.end() ? 0 : entry->second;
  if (!hasRoom(used_, bytes, limits_.bytes) || !hasRoom(usedByAddress, bytes, limits_.bytesOfAddress))
    return false;
  if (!key.empty()) ofAddress_[key] += bytes;
  used_ += bytes;
  return true;
}

void AnswerBudget::release(const std::string& key, std::size_t bytes) {
  if (bytes == 0) return;
  used_ -= bytes;
  if (key.empty()) return;
  const auto entry = ofAddress_.find(key);
  if ((entry->second -= bytes) == 0) ofAddress_.erase(entry);
}

}  // namespace clothstream::endpoint
