// SPDX-License-Identifier: MIT
#include "server/fleet/subjects.h"

#include <fmt/format.h>

namespace clothstream::fleet {

// Names of scenes consist of [a-z0-9_-], which subjects may contain.
std::string streamSubject(const std::string& scene, std::uint64_t stream) {
  return fmt::format("clothstream.{}.{:016x}", scene, stream);
}

std::string framesSubject(const std::string& stream, std::uint8_t quality, std::uint8_t layer) {
  return fmt::format("{}.frames.{}.{}", stream, quality, layer);
}

std::string framesPattern(const std::string& stream, std::optional<std::uint8_t> quality) {
  return quality ? fmt::format("{}.frames.{}.*", stream, *quality) : stream + ".frames.*.*";
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

}  // namespace clothstream::fleet
