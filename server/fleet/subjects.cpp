// SPDX-License-Identifier: MIT
#include "server/fleet/subjects.h"

#include <array>
#include <charconv>
#include <system_error>

#include <fmt/format.h>

namespace clothstream::fleet {
namespace {

constexpr std::string_view kInbox = "clothstream.inbox.";

}  // namespace

// Names of scenes consist of [a-z0-9_-], which subjects may contain.
std::string streamSubject(const std::string& scene, std::uint64_t stream) {
  return fmt::format("clothstream.{}.{:016x}", scene, stream);
}

std::string framesSubject(const std::string& stream, std::uint8_t quality) {
  return fmt::format("{}.frames.{}", stream, quality);
}

std::string framesPattern(const std::string& stream, std::optional<std::uint8_t> quality) {
  return quality ? framesSubject(stream, *quality) : stream + ".frames.*";
}

std::string eventsSubject(const std::string& stream) {
  return stream + ".events";
}

std::string interestSubject(const std::string& stream) {
  return stream + ".interest";
}

std::string descriptionSubject(const std::string& stream) {
  return stream + ".description";
}

std::string upSubject(const std::string& stream, const TunnelId& tunnel) {
  return fmt::format("{}.up.{:016x}.{:016x}", stream, tunnel.edge, tunnel.peer);
}

std::string downSubject(const std::string& stream, const TunnelId& tunnel) {
  return fmt::format("{}.down.{:016x}.{:016x}", stream, tunnel.edge, tunnel.peer);
}

std::string upPattern(const std::string& stream) {
  return stream + ".up.*.*";
}

std::string downPattern(const std::string& stream, std::uint64_t edge) {
  return fmt::format("{}.down.{:016x}.*", stream, edge);
}

std::optional<TunnelId> tunnelOf(const std::string& subject) {
  constexpr std::size_t kDigits = 16, kEnd = 2 * kDigits + 1;
  if (subject.size() <= kEnd) return std::nullopt;
  const std::string_view end = std::string_view(subject).substr(subject.size() - kEnd);
  std::array<std::uint64_t, 2> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const char* const first = end.data() + i * (kDigits + 1);
    const auto [last, problem] = std::from_chars(first, first + kDigits, numbers[i], 16);
    if (problem != std::errc() || last != first + kDigits) return std::nullopt;
  }
  return TunnelId{numbers[0], numbers[1]};
}

std::string inboxSubject(const std::string& role) {
  return std::string(kInbox) + role;
}

bool isInbox(std::string_view subject) {
  return subject.starts_with(kInbox);
}

std::string serverSubject(std::uint64_t origin) {
  return fmt::format("clothstream.servers.{:016x}", origin);
}

std::string moveUpSubject(std::uint64_t move) {
  return fmt::format("clothstream.moves.{:016x}.up", move);
}

std::string moveDownSubject(std::uint64_t move) {
  return fmt::format("clothstream.moves.{:016x}.down", move);
}

}  // namespace clothstream::fleet
