// SPDX-License-Identifier: MIT
#include "clients/cli/saved_token.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/tls/fingerprint.h"

namespace clothstream::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxTokenBytes = 4096;

struct Close {
  void operator()(std::FILE* file) const {
    if (file != stdin) std::fclose(file);
  }
};

tl::unexpected<std::string> failed(const fs::path& file, const char* what) {
  return tl::unexpected(fmt::format("{} {}: {}", what, file.string(), std::strerror(errno)));
}

// File of the server in this directory of what the program keeps; empty without a home.
fs::path fileOf(const ServerAddress& server, const char* directory) {
  fs::path state;
  if (const char* stateHome = std::getenv("XDG_STATE_HOME"); stateHome != nullptr && *stateHome != '\0')
    state = stateHome;
  else if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    state = fs::path(home) / ".local" / "state";
  else
    return {};
  std::string name = (server.isEncrypted() ? "tls_" : "plain_") + server.hostAndPort();
  for (char& c : name)
    if (c == ':' || c == '/' || c == '[' || c == ']') c = '_';
  return state / "clothstream" / directory / name;
}

}  // namespace

fs::path tokenFileOf(const ServerAddress& server) {
  return fileOf(server, "tokens");
}

fs::path fingerprintFileOf(const ServerAddress& server) {
  return fileOf(server, "servers");
}

tl::expected<std::string, std::string> keptFingerprint(const ServerAddress& server) {
  const fs::path file = fingerprintFileOf(server);
  std::error_code none;
  if (file.empty() || !fs::exists(file, none)) return std::string();
  const auto line = readToken(file);
  const auto fingerprint = line ? normalFingerprint(*line) : std::nullopt;
  if (!fingerprint)
    return tl::unexpected(
        fmt::format("{} has no fingerprint: delete it, and pair with the server again", file.string()));
  return *fingerprint;
}

tl::expected<std::string, std::string> readToken(const fs::path& file) {
  const std::unique_ptr<std::FILE, Close> in(file == "-" ? stdin : std::fopen(file.c_str(), "rbe"));
  if (!in) return failed(file, "cannot read the token in");
  std::array<char, kMaxTokenBytes + 64> bytes{};
  const std::size_t count = std::fread(bytes.data(), 1, bytes.size(), in.get());
  if (std::ferror(in.get()) != 0) return failed(file, "cannot read the token in");
  const std::string text(bytes.data(), count);
  constexpr const char* kSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kSpace), last = text.find_last_not_of(kSpace);
  if (first == std::string::npos) return tl::unexpected(fmt::format("{} has no token", file.string()));
  std::string token = text.substr(first, last - first + 1);
  if (token.size() > kMaxTokenBytes || token.find_first_of(kSpace) != std::string::npos)
    return tl::unexpected(fmt::format("{} is not a token: one line of at most {} bytes is allowed",
                                      file.string(), kMaxTokenBytes));
  return token;
}

tl::expected<void, std::string> saveLine(const fs::path& file, const std::string& text) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error)
    return tl::unexpected(fmt::format("cannot make {}: {}", file.parent_path().string(), error.message()));
  fs::permissions(file.parent_path(), fs::perms::owner_all, error);
  const fs::path next = file.string() + ".new";
  const int descriptor =
      ::open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR);
  if (descriptor < 0) return failed(next, "cannot write");
  const std::string line = text + "\n";
  const bool written = ::fchmod(descriptor, S_IRUSR | S_IWUSR) == 0 &&
                       ::write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const bool closed = ::close(descriptor) == 0;
  if (!written || !closed || ::rename(next.c_str(), file.c_str()) != 0) return failed(file, "cannot write");
  return {};
}

}  // namespace clothstream::cli
