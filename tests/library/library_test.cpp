// SPDX-License-Identifier: MIT
// Programs in C, Python, C# and Rust use libclothstream.so with the real clothstream-server.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <ostream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "clients/grpc/grpc_client.h"
#include "clients/native/pairing.h"
#include "clients/websocket/web_socket_transport.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;

// Generous timeouts for sanitizers, validation and software Vulkan on a busy machine.
constexpr auto kProgram = 120s;

using Command = std::vector<std::string>;

struct Ended {
  int code = -1;
  std::string output, errors;
};

// Runs a program from PATH with the folder of this library in LD_LIBRARY_PATH.
Ended run(const Command& command, const char* library = CLOTHSTREAM_LIBRARY) {
  Command all{"/usr/bin/env",
              std::string("LD_LIBRARY_PATH=") + std::filesystem::path(library).parent_path().string()};
  all.insert(all.end(), command.begin(), command.end());
  Process process(all);
  const std::optional<int> code = process.waitForEnd(kProgram);
  return {code.value_or(-1), process.output(), process.errors()};
}

bool succeeds(const Command& command) {
  return run(command).code == 0;
}

bool hasTool(const std::string& name) {
  return succeeds({"sh", "-c", "command -v " + name});
}

std::uint64_t fnv1a(const float* values, std::size_t count) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto* bytes = reinterpret_cast<const unsigned char*>(values);
  for (std::size_t i = 0; i < count * sizeof(float); ++i) hash = (hash ^ bytes[i]) * 0x100000001b3u;
  return hash;
}

std::string contents(const char* path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Second client for comparison, over gRPC. It records the hash of each frame.
class Watcher {
 public:
  explicit Watcher(const std::string& address) {
    NativeClientOptions options;
    options.displayName = "watcher";
    auto joined = joinByGrpc(address, options, [this](cs_client* client, std::uint32_t events) {
      if ((events & CS_EVENT_FRAME) == 0) return;
      cs_statistics statistics;
      cs_get_statistics(client, NativeClient::nowUs(), &statistics);
      const std::uint64_t hash = fnv1a(cs_positions(client), std::size_t{3} * cs_vertex_count(client));
      const std::lock_guard lock(mutex_);
      hashes_[statistics.tick] = hash;
    });
    if (!joined) throw std::runtime_error(joined.error().text);
    client_ = std::move(*joined);
  }

  // Counts the lines "frame TICK HASH" whose tick was seen here. Each must have the same hash.
  std::size_t sameFrames(const std::string& output) const {
    const std::lock_guard lock(mutex_);
    std::istringstream lines(output);
    std::size_t same = 0;
    for (std::string word; lines >> word;) {
      if (word != "frame") continue;
      std::uint64_t tick = 0, hash = 0;
      lines >> tick >> std::hex >> hash >> std::dec;
      const auto seen = hashes_.find(tick);
      if (seen == hashes_.end()) continue;
      EXPECT_EQ(seen->second, hash) << "tick " << tick;
      ++same;
    }
    return same;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, std::uint64_t> hashes_;
  std::unique_ptr<NativeClient> client_;
};

class LibraryTest : public RunningServer {
 protected:
  void SetUp() override { startServer(); }

  // Runs a program that follows the stream, and compares its frames.
  void expectSameFrames(const Command& command, const char* library = CLOTHSTREAM_LIBRARY) {
    const Watcher watcher(address_);
    const Ended ended = run(command, library);
    ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
    const std::size_t same = watcher.sameFrames(ended.output);
    std::printf("%zu frames were the same\n", same);
    EXPECT_GE(same, 20u);
    if (const auto stages = ended.output.find("stages: "); stages != std::string::npos)
      std::printf("%s", ended.output.c_str() + stages);
  }
};

// A program without the sanitizer cannot load a library with it.
constexpr bool kSanitized = CLOTHSTREAM_SANITIZE[0] != '\0';
constexpr const char* kNotSanitized = "only programs that are built with the sanitizer can load the library";

TEST_F(LibraryTest, ServesC) {
  expectSameFrames({FOLLOW_C, web_});
}

TEST_F(LibraryTest, ServesCOverGrpc) {
  expectSameFrames({FOLLOW_C, address_}, CLOTHSTREAM_LIBRARY_OVER_GRPC);
}

TEST_F(LibraryTest, ReportsTheEndOfTheStream) {
  Process program({FOLLOW_C, web_, "lost"});
  ASSERT_TRUE(program.waitForLine("joined", kPatience)) << program.errors();
  server_->signal(SIGTERM);
  EXPECT_EQ(program.waitForEnd(kProgram), 0) << program.errors();
}

TEST_F(LibraryTest, ReceivesTheRequestedQuality) {
  const Ended ended = run({FOLLOW_C, web_, "wants"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
}

TEST_F(LibraryTest, PairsOverGrpcToo) {
  const TemporaryDirectory state;
  TearDown();
  Arguments arguments = kSmallScene;
  arguments.insert(arguments.end(), {"--pairing", "--state-dir", state.path()});
  startServer(arguments);
  const std::string code = server_->waitForLine("pair    ", kPatience).value_or("").substr(0, 6);
  const auto transport = makeGrpcTransport(address_);
  const auto token = pairOver(*transport, address_, code, kPatience);
  ASSERT_TRUE(token) << token.error().text;
  ServerAddress server(address_);
  server.token = *token;
  const auto joined = joinByGrpc(server, {}, [](cs_client*, std::uint32_t) {});
  EXPECT_TRUE(joined) << joined.error().text;
}

TEST_F(LibraryTest, ServesPythonWithoutACopy) {
  if (kSanitized) GTEST_SKIP() << kNotSanitized;
  if (!succeeds({CLOTHSTREAM_PYTHON, "-c", "import numpy"}))
    GTEST_SKIP() << CLOTHSTREAM_PYTHON " has no numpy: ./dev test installs Debian's python3-numpy";
  expectSameFrames({"/usr/bin/env", "PYTHONPATH=clients/python/src",
                    "CLOTHSTREAM_LIBRARY=" CLOTHSTREAM_LIBRARY, CLOTHSTREAM_PYTHON, "-B",
                    "tests/library/follow.py", web_});
}

TEST_F(LibraryTest, ServesCSharp) {
  if (kSanitized) GTEST_SKIP() << kNotSanitized;
  if (!hasTool("mcs") || !hasTool("mono"))
    GTEST_SKIP() << "mono is not installed: ./dev test installs Debian's mono-mcs and mono-runtime";
  const TemporaryDirectory directory;
  const std::string program = directory.path() / "Follow.exe";
  const Ended compiled =
      run({"mcs", "-unsafe", "-warnaserror", "-out:" + program, "tests/library/Follow.cs"});
  ASSERT_EQ(compiled.code, 0) << compiled.output << compiled.errors;
  expectSameFrames({"mono", program, web_});
}

// Example: a game that draws all the time.
void receivesFramesWhileOftenAcquired(const std::string& address, std::unique_ptr<Transport> transport) {
  const auto client = NativeClient::join(address, std::move(transport), {}, [](cs_client*, std::uint32_t) {});
  ASSERT_TRUE(client.has_value()) << client.error().text;
  const auto end = std::chrono::steady_clock::now() + 3s;
  std::uint64_t frames = 0, acquired = 0;
  for (; std::chrono::steady_clock::now() < end; ++acquired) {
    cs_statistics statistics;
    cs_get_statistics((*client)->lock(), NativeClient::nowUs(), &statistics);
    (*client)->unlock();
    frames = statistics.frames;
  }
  std::printf("acquired %llu times, %llu frames\n", static_cast<unsigned long long>(acquired),
              static_cast<unsigned long long>(frames));
  // 180 frames on a machine that simulates in real time.
  EXPECT_GE(frames, 30u);
}

TEST_F(LibraryTest, ReceivesFramesWhileOftenAcquired) {
  receivesFramesWhileOftenAcquired(web_, makeWebSocketTransport(web_));
  receivesFramesWhileOftenAcquired(address_, makeGrpcTransport(address_));
}

// ---- Examples of docs/client-library.md and examples/

struct Language {
  const char* name;   // language of the code block in docs/client-library.md; c: examples/c
  const char* file;   // file name of the example
  const char* tool;   // required program; the test is skipped without it
  const char* toRun;  // shell command with {file}, {program} and {address}

  friend std::ostream& operator<<(std::ostream& out, const Language& language) {
    return out << language.name;
  }
};

class Example : public LibraryTest, public ::testing::WithParamInterface<Language> {
 protected:
  // Returns the first code block of a language.
  static std::string block(const std::string& language) {
    std::ifstream page("docs/client-library.md");
    std::string text, line;
    bool inside = false;
    while (std::getline(page, line)) {
      if (inside && line == "```") break;
      if (inside) text += line + "\n";
      inside |= line == "```" + language;
    }
    return text;
  }
};

TEST_P(Example, Runs) {
  if (kSanitized) GTEST_SKIP() << kNotSanitized;
  const Language& language = GetParam();
  if (!hasTool(language.tool)) GTEST_SKIP() << language.tool << " is not installed";
  if (std::string(language.name) == "python" && !succeeds({CLOTHSTREAM_PYTHON, "-c", "import numpy"}))
    GTEST_SKIP() << CLOTHSTREAM_PYTHON " has no numpy: ./dev test installs Debian's python3-numpy";
  const std::string text =
      std::string(language.name) == "c" ? contents("examples/c/follow.c") : block(language.name);
  ASSERT_FALSE(text.empty());
  const TemporaryDirectory directory;
  const std::string file = directory.path() / language.file;
  std::ofstream(file) << text;
  std::string line = language.toRun;
  const auto fill = [&](const std::string& what, const std::string& with) {
    for (std::size_t at; (at = line.find(what)) != std::string::npos;) line.replace(at, what.size(), with);
  };
  fill("{file}", file);
  fill("{program}", directory.path() / "program");
  fill("{address}", web_);
  fill("{include}", CLOTHSTREAM_INCLUDE);
  fill("{python}", CLOTHSTREAM_PYTHON);
  fill("{folder}", std::filesystem::path(CLOTHSTREAM_LIBRARY).parent_path());
  const Ended ended = run({"sh", "-c", line});
  ASSERT_EQ(ended.code, 0) << line << "\n" << ended.output << ended.errors;
  EXPECT_THAT(ended.output, HasSubstr("320 vertices, the first at -0.80 "));
}

INSTANTIATE_TEST_SUITE_P(
    Languages, Example,
    ::testing::Values(
        Language{"c", "example.c", "cc",
                 "cc -std=c11 -Wall -Wextra -Wpedantic -Werror -I{include} {file} -o {program} "
                 "-L{folder} "
                 "-lclothstream && {program} {address}"},
        Language{"python", "example.py", CLOTHSTREAM_PYTHON,
                 "PYTHONPATH=clients/python/src CLOTHSTREAM_LIBRARY={folder}/libclothstream.so {python} -B "
                 "{file} {address}"},
        Language{"csharp", "Example.cs", "mcs",
                 "mcs -unsafe -out:{program} {file} && mono {program} {address}"},
        Language{"rust", "example.rs", "/usr/bin/rustc",
                 "/usr/bin/rustc -D warnings -L {folder} {file} -o {program} && {program} {address}"}),
    [](const auto& language) { return std::string(language.param.name); });

// ---- Exported functions

std::set<std::string> matches(const std::string& text, const char* pattern) {
  std::set<std::string> found;
  const std::regex expression(pattern);
  for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end; ++match)
    found.insert((*match)[1]);
  return found;
}

TEST(Library, ExportsItsInterfaceAndNothingElse) {
  if (!hasTool("nm")) GTEST_SKIP() << "nm is not installed";
  std::set<std::string> declared;
  for (const auto& header : nlohmann::json::parse(contents("clients/interface/interface.json")))
    for (const auto& [name, function] : header["functions"].items()) declared.insert(name);
  const Ended symbols = run({"nm", "-D", "--defined-only", CLOTHSTREAM_LIBRARY});
  ASSERT_EQ(symbols.code, 0) << symbols.errors;
  EXPECT_EQ(matches(symbols.output, R"([0-9a-f]+ . ([^\n]+))"), declared);
}

// ---- Hooks of the program (hooks.c)

TEST_F(LibraryTest, TakesItsMemoryFromTheProgram) {
  if (kSanitized) GTEST_SKIP() << "a library with sanitizers uses their memory functions";
  const Ended ended = run({LIBRARY_HOOKS_C, web_});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_THAT(ended.output, HasSubstr("allocated much, live 0, misaligned 0\nsecond call: 1\n"));
  const Ended refused = run({"env", "REFUSE=1", LIBRARY_HOOKS_C, web_});
  EXPECT_THAT(refused.output, HasSubstr("1 The allocator is NULL, has NULL functions"));
}

TEST_F(LibraryTest, LogTellsWhatHappensToTheStream) {
  if (kSanitized) GTEST_SKIP() << "hooks.c needs its memory functions";
  Process program({"/usr/bin/env", "WAIT=1",
                   "LD_LIBRARY_PATH=" + std::filesystem::path(CLOTHSTREAM_LIBRARY).parent_path().string(),
                   LIBRARY_HOOKS_C, web_});
  ASSERT_TRUE(program.waitForOutput("log 1: joined the scene small of clothstream-server", kProgram))
      << program.output() << program.errors();
  const std::string port = std::to_string(portIn(web_));
  server_->signal(SIGKILL);
  EXPECT_TRUE(program.waitForOutput("log 2: ", kProgram)) << program.output();
  EXPECT_TRUE(program.waitForOutput("log 1: reconnecting in ", kProgram)) << program.output();
  server_->waitForEnd(kProgram);
  startServer({"--scene", "small", "--scene-file", "tests/e2e/small.json", "--port", port});
  EXPECT_TRUE(program.waitForOutput("log 1: reconnected as a new participant", kProgram)) << program.output();
  program.signal(SIGKILL);
}

TEST(Library, NeedsOnlyTlsAndLibc) {
  if (kSanitized) GTEST_SKIP() << "the sanitizers are libraries too";
  if (!hasTool("ldd")) GTEST_SKIP() << "ldd is not installed";
  const Ended needed = run({"ldd", CLOTHSTREAM_LIBRARY});
  ASSERT_EQ(needed.code, 0) << needed.errors;
  const std::set<std::string> names = matches(needed.output, R"(\s(?:/\S+/)?([a-z][a-z0-9_+-]*)\.so)");
  const std::set<std::string> allowed{
      "linux-vdso", "ld-linux-x86-64", "ld-linux-aarch64", "libssl", "libcrypto", "libm", "libc"};
  EXPECT_THAT(names, Contains("libssl"));
  for (const std::string& name : names) EXPECT_THAT(allowed, Contains(name)) << needed.output;
}

}  // namespace
}  // namespace clothstream::e2e
