// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of other participants, which this client asks the server for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/core/wire/room_surface.h"

namespace clothstream::client {

// Asks for one part at a time, and for a few parts in a window, so that frames come between them.
class RoomSurfaces {
 public:
  static constexpr std::uint32_t kWindow = 4;          // parts
  static constexpr std::uint64_t kWindowUs = 100'000;  // time between two windows

  struct Surface {
    RoomSurfaceEntry entry;
    RoomMesh mesh;
    std::uint32_t nextPart = 0;
    bool isBroken = false;  // the server does not send this mesh
    bool isComplete() const { return !isBroken && nextPart == entry.parts; }
  };

  // Whether meshes are asked for. Off by default: the list is then ignored.
  void follow(bool on);

  // The server has sent a list. Returns whether the complete surfaces have changed.
  bool listed(const std::vector<RoomSurfaceEntry>& entries, std::uint64_t ownParticipant);
  // The connection has ended, or begun: nothing is known. Returns whether there were complete surfaces.
  bool forget();

  // An answer of the server. Returns whether a surface is complete with it. Ignores an answer for which this
  // does not wait.
  bool answered(std::uint64_t requestId, Bytes message);
  // The server refuses a request. `isTooEarly`: for now. Returns false if it is not one of these.
  bool refused(std::uint64_t requestId, bool isTooEarly);

  void update(std::uint64_t nowUs);
  // Returns the next request, or nullptr. `lastId` is the id of the newest request of the client, which the
  // next one exceeds. Valid until the next call of this function.
  const std::string* next(std::uint64_t& lastId);

  // Surfaces whose meshes are complete, in the order of the server's list. Valid until the next call of
  // another function.
  const std::vector<const Surface*>& complete() const { return complete_; }

 private:
  void collect();
  Surface* missing();

  std::vector<Surface> surfaces_;
  std::vector<const Surface*> complete_;
  bool follows_ = false;
  std::uint64_t waitsFor_ = 0;  // request id; 0: for none
  // The surface of that request.
  RoomSurfaceEntry asked_;
  std::uint32_t left_ = kWindow;
  std::uint64_t openedUs_ = 0;
  std::string message_;
};

}  // namespace clothstream::client
