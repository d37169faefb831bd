// SPDX-License-Identifier: MIT
#include "clients/core/stream/own_surfaces.h"

#include <algorithm>
#include <utility>

namespace clothstream::client {

OwnSurface* OwnSurfaces::find(std::uint32_t id) {
  const auto found = std::find_if(surfaces_.begin(), surfaces_.end(),
                                  [&](const OwnSurface& surface) { return surface.id == id; });
  return found == surfaces_.end() ? nullptr : &*found;
}

void OwnSurfaces::forgetOrders(std::uint32_t id) {
  // The server drops a mesh that is not complete when the next one begins.
  if (!orders_.empty() && orders_.front().id == id) nextPart_ = 0;
  orders_.erase(
      std::remove_if(orders_.begin(), orders_.end(),
                     [&](const Order& order) { return order.id == id && order.what != What::others; }),
      orders_.end());
}

void OwnSurfaces::set(OwnSurface surface) {
  forgetOrders(surface.id);
  if (sends_) orders_.push_back({surface.id, What::mesh});
  if (OwnSurface* const known = find(surface.id))
    *known = std::move(surface);
  else
    surfaces_.push_back(std::move(surface));
}

bool OwnSurfaces::move(std::uint32_t id, const std::array<float, 3>& position,
                       const std::array<float, 4>& orientation) {
  OwnSurface* const surface = find(id);
  if (surface == nullptr) return false;
  surface->position = position;
  surface->orientation = orientation;
  // A mesh that has not begun takes the pose along.
  const auto order = std::find_if(orders_.begin(), orders_.end(), [&](const Order& waiting) {
    const bool begun = &waiting == &orders_.front() && nextPart_ > 0;
    return waiting.id == id && !begun;
  });
  if (sends_ && order == orders_.end()) orders_.push_back({id, What::pose});
  return true;
}

bool OwnSurfaces::remove(std::uint32_t id) {
  const OwnSurface* const surface = find(id);
  if (surface == nullptr) return false;
  surfaces_.erase(surfaces_.begin() + (surface - surfaces_.data()));
  forgetOrders(id);
  if (sends_) orders_.push_back({id, What::removal});
  return true;
}

void OwnSurfaces::sendAll(bool mayHaveOthers) {
  sends_ = true;
  orders_.clear();
  nextPart_ = 0;
  if (mayHaveOthers) orders_.push_back({0, What::others});
  for (const OwnSurface& surface : surfaces_) orders_.push_back({surface.id, What::mesh});
}

void OwnSurfaces::sendNothing(bool mayHaveSome) {
  sends_ = false;
  orders_.clear();
  nextPart_ = 0;
  if (mayHaveSome) orders_.push_back({0, What::others});
}

void OwnSurfaces::update(std::uint64_t nowUs) {
  if (left_ == kWindow || nowUs - openedUs_ < kWindowUs) return;
  openedUs_ = nowUs;
  left_ = kWindow;
}

void OwnSurfaces::finish() {
  orders_.pop_front();
  nextPart_ = 0;
}

const std::string* OwnSurfaces::next() {
  if (orders_.empty() || left_ == 0) return nullptr;
  --left_;
  const Order order = orders_.front();
  if (order.what == What::others) {
    writeKeptSurfaces(message_, sends_ ? surfaces_ : std::span<const OwnSurface>());
    finish();
    return &message_;
  }
  if (order.what == What::removal) {
    writeSurfaceRemoval(message_, order.id);
    finish();
    return &message_;
  }
  const OwnSurface& surface = *find(order.id);
  if (order.what == What::pose) {
    writeSurfacePose(message_, surface);
    finish();
    return &message_;
  }
  writeSurfacePart(message_, surface, nextPart_);
  if (++nextPart_ == surfacePartCount(surface)) finish();
  return &message_;
}

}  // namespace clothstream::client
