// SPDX-License-Identifier: MIT
// Surfaces of the real room of this participant, and what the server has to get of them.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "clients/core/wire/surface.h"

namespace clothstream::client {

// Keeps the surfaces, so that they can be sent again after a reconnect. A few parts are sent at a time, so
// that acknowledgements of frames never wait behind a whole mesh.
class OwnSurfaces {
 public:
  static constexpr std::uint32_t kWindow = 4;          // parts
  static constexpr std::uint64_t kWindowUs = 100'000;  // time between two windows

  bool empty() const { return surfaces_.empty(); }

  // Adds a surface, or replaces the one with its id.
  void set(OwnSurface surface);
  // Returns false if there is no such surface.
  bool move(std::uint32_t id, const std::array<float, 3>& position, const std::array<float, 4>& orientation);
  // Returns false if there is no such surface.
  bool remove(std::uint32_t id);

  // All are sent. `mayHaveOthers`: the participant was there before, and the server may have surfaces of it
  // that are no longer there. Else the server has none.
  void sendAll(bool mayHaveOthers);
  // The server takes none, or the program does not allow that it has some: nothing is sent until sendAll().
  // `mayHaveSome`: the server may have surfaces of this participant, and removes them.
  void sendNothing(bool mayHaveSome);
  // The program allows that they are sent, or no longer.
  void allow() {
    if (!sends_) sendAll(true);
  }
  void takeBack() {
    if (sends_) sendNothing(true);
  }

  void update(std::uint64_t nowUs);
  // Returns the next message, or nullptr. Valid until the next call of this function.
  const std::string* next();

 private:
  // The last one removes what the server has and should not have.
  enum class What : std::uint8_t { mesh, pose, removal, others };
  struct Order {
    std::uint32_t id;  // 0 with What::others
    What what;
  };
  OwnSurface* find(std::uint32_t id);
  void forgetOrders(std::uint32_t id);
  void finish();  // the first order

  std::vector<OwnSurface> surfaces_;
  std::deque<Order> orders_;
  std::uint32_t nextPart_ = 0;  // of the mesh of the first order
  std::uint32_t left_ = kWindow;
  std::uint64_t openedUs_ = 0;
  bool sends_ = false;
  std::string message_;
};

}  // namespace clothstream::client
