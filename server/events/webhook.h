// SPDX-License-Identifier: MIT
// Signatures of webhooks, as the specification Standard Webhooks defines them
// (https://www.standardwebhooks.com).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::events {

inline constexpr std::size_t kMinKeyBytes = 24, kMaxKeyBytes = 64;

// Returns the key in a secret such as whsec_MTIzNDU2Nzg5MGFiY2RlZmdoaWprbG1u, or what is wrong with it. Space
// around the secret is ignored. The error does not show the secret.
tl::expected<std::string, std::string> parseSecret(std::string_view text);
// The same for the content of a file. Throws std::runtime_error, with the name of the file. Logs a warning if
// other users can read it.
std::string readSecret(const std::filesystem::path& file);

// Value of the header `webhook-signature`. `timestamp` is in seconds since 1970.
std::string signatureOf(const std::string& key, std::string_view id, std::int64_t timestamp,
                        std::string_view body);

// Random value of the header `webhook-id`, which is the same for each attempt to deliver a message.
std::string makeId();

}  // namespace clothstream::events
