// SPDX-License-Identifier: MIT
// Checks the meshes of surfaces of the real room, and makes their trees, beside the endpoints' threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include <boost/asio/thread_pool.hpp>

#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"
#include "server/messages/surface_message.h"
#include "server/scene/live_scene.h"

namespace clothstream::hosting {

// A mesh whose parts have all arrived.
struct CompleteSurface {
  messages::SurfaceParts parts;
  scene::RoomSurfaces::Ticket ticket;
  bool twoSided = false;
  float friction = 1;
  UploadReservation reservation;  // of the parts
};

// Thread-safe. Makes one surface after the other, about 1 us for each triangle, in the order in which they
// arrive.
class SurfaceMaker {
 public:
  SurfaceMaker();
  // Drops the surfaces that wait.
  ~SurfaceMaker();
  SurfaceMaker(const SurfaceMaker&) = delete;
  SurfaceMaker& operator=(const SurfaceMaker&) = delete;

  // Largest number of surfaces that wait.
  static constexpr std::uint32_t kMaxWaiting = 256;

  // Called once, on the thread of this object, with the result of scene::RoomSurfaces::put() or the error of
  // the mesh. Must not block.
  using Done = std::function<void(const messages::Result<void>&)>;
  // Puts the surface into the scene when it is made. Returns an error, and never calls `done`, if too many
  // wait.
  [[nodiscard]] messages::Result<void> make(std::shared_ptr<scene::LiveScene> scene, CompleteSurface surface,
                                            Done done);

 private:
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> waiting_{0};
  boost::asio::thread_pool thread_{1};
};

}  // namespace clothstream::hosting
