// SPDX-License-Identifier: MIT
// One thread does everything. It sleeps until a packet enters or is due.
#include "tests/link/forward.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

namespace clothstream::link {
namespace {

constexpr std::size_t kMaxPacket = 65'536;
// Packets to read before those that are due leave.
constexpr int kMaxReads = 64;

// Whether the destination of an IP packet is one machine.
bool isUnicast(std::span<const std::byte> packet) {
  constexpr std::size_t kDestination4 = 16, kDestination6 = 24;
  if (packet.empty()) return false;
  if (std::to_integer<int>(packet[0] >> 4) == 6)
    return packet.size() > kDestination6 && std::to_integer<int>(packet[kDestination6]) != 0xff;
  return packet.size() > kDestination4 && std::to_integer<int>(packet[kDestination4]) < 224;
}

void readAll(Way& way) {
  std::array<std::byte, kMaxPacket> bytes;
  for (int i = 0; i < kMaxReads; ++i) {
    const ssize_t count = ::read(way.from, bytes.data(), bytes.size());
    if (count < 0) {
      if (errno == EAGAIN || errno == EINTR) return;
      throw std::runtime_error(fmt::format("a device cannot be read: {}", std::strerror(errno)));
    }
    const std::span<const std::byte> packet(bytes.data(), static_cast<std::size_t>(count));
    if (isUnicast(packet)) way.direction.enter(packet, Clock::now());
  }
}

void deliver(Way& way) {
  const Clock::time_point now = Clock::now();
  for (auto due = way.direction.next(); due && *due <= now; due = way.direction.next()) {
    const std::vector<std::byte> packet = way.direction.leave();
    way.late.add(now - *due);
    if (::write(way.to, packet.data(), packet.size()) < 0) ++way.refused;
  }
}

// Time until the next packet of both ways is due; nothing if both are empty.
std::optional<timespec> timeToNext(const Way& down, const Way& up) {
  const auto first = down.direction.next(), second = up.direction.next();
  if (!first && !second) return std::nullopt;
  const Clock::time_point next =
      std::min(first.value_or(Clock::time_point::max()), second.value_or(Clock::time_point::max()));
  const Clock::duration left = std::max(next - Clock::now(), Clock::duration(0));
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
  return timespec{.tv_sec = seconds.count(), .tv_nsec = std::chrono::nanoseconds(left - seconds).count()};
}

}  // namespace

void forward(Way& down, Way& up, int signals) {
  std::array<pollfd, 3> watched{{{down.from, POLLIN, 0}, {up.from, POLLIN, 0}, {signals, POLLIN, 0}}};
  while (true) {
    const std::optional<timespec> wait = timeToNext(down, up);
    if (ppoll(watched.data(), watched.size(), wait ? &*wait : nullptr, nullptr) < 0 && errno != EINTR)
      throw std::runtime_error(fmt::format("ppoll: {}", std::strerror(errno)));
    if (watched[2].revents != 0) return;
    readAll(down);
    readAll(up);
    deliver(down);
    deliver(up);
  }
}

}  // namespace clothstream::link
