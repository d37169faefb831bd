// SPDX-License-Identifier: MIT
// Subjects of the messages between servers (fleet.proto).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace clothstream::fleet {

inline constexpr const char* kOffers = "clothstream.scenes";

// Part that the subjects of one stream have in common, without a dot at its end.
std::string streamSubject(const std::string& scene, std::uint64_t stream);

std::string framesSubject(const std::string& stream, std::uint8_t quality, std::uint8_t layer);
// All layers of this quality, or of all qualities.
std::string framesPattern(const std::string& stream, std::optional<std::uint8_t> quality);
std::string eventsSubject(const std::string& stream);
std::string interestSubject(const std::string& stream);
std::string descriptionSubject(const std::string& stream);

}  // namespace clothstream::fleet
