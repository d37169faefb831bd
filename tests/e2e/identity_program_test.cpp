// SPDX-License-Identifier: MIT
// The real clothstream-server with tokens and pairing, and `clothstream` as its client.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/rpc_client.h"

namespace clothstream::e2e {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class IdentityProgram : public RunningServer {
 protected:
  struct Answer {
    int exitCode = -1;
    std::string output, errors;
  };
  static Answer finish(Process&& process) {
    const auto code = process.waitForEnd(kPatience);
    return {code.value_or(-1), process.output(), process.errors()};
  }
  // Runs `clothstream`. Its tokens are kept below the test's directory.
  Answer client(const Arguments& arguments) const {
    Arguments command{"/usr/bin/env", "XDG_STATE_HOME=" + kept(), CLOTHSTREAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return finish(Process(command));
  }
  static Answer program(Arguments arguments) {
    arguments.insert(arguments.begin(), CLOTHSTREAM_SERVER);
    return finish(Process(arguments));
  }
  void startWith(const Arguments& more) {
    Arguments arguments = kSmallScene;
    arguments.insert(arguments.end(), more.begin(), more.end());
    startServer(arguments);
  }
  // Makes a key, and returns its file.
  std::string key(const std::string& name) const {
    std::filesystem::create_directories(keys());
    const std::string file = keys() + "/" + name;
    EXPECT_EQ(program({"token", "--new-key", file}).exitCode, 0);
    return file;
  }
  // Prints a token of the key into a file, and returns the file.
  std::string token(const std::string& keyFile, Arguments more) const {
    more.insert(more.begin(), {"token", "--key", keyFile});
    const Answer made = program(more);
    EXPECT_EQ(made.exitCode, 0) << made.errors;
    const std::string file = directory_.path() / ("token " + std::to_string(++tokens_));
    std::ofstream(file) << made.output;
    return file;
  }
  std::string keys() const { return directory_.path() / "keys"; }
  std::string state() const { return directory_.path() / "state"; }
  std::string kept() const { return directory_.path() / "kept"; }

  TemporaryDirectory directory_;
  mutable int tokens_ = 0;
};

TEST_F(IdentityProgram, ServesOnlyClientsWithTokens) {
  const std::string first = key("first.pem");
  startWith({"--token-keys", keys()});
  if (IsSkipped()) return;
  const Answer stranger = client({"list", address_});
  EXPECT_EQ(stranger.exitCode, 4);
  EXPECT_THAT(stranger.errors,
              AllOf(HasSubstr("requires a token"), HasSubstr("Use --token FILE, or --pair CODE.")));
  EXPECT_EQ(client({"join", address_, "--seconds", "0.5"}).exitCode, 4);
  EXPECT_EQ(client({"list", address_, "--token", "/nowhere"}).exitCode, 4);
  tests::RpcStream reflection(portIn(address_),
                              {.method = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"});
  EXPECT_EQ(reflection.receive(), std::nullopt);
  EXPECT_EQ(reflection.finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);

  const std::string owner = token(first, {"--role", "owner", "--subject", "ada"});
  const std::string guest = token(first, {"--subject", "ben", "--name", "Ben"});
  EXPECT_EQ(client({"list", address_, "--token", guest}).exitCode, 0);
  const Answer joined = client({"join", address_, "--token", guest, "--seconds", "0.5"});
  EXPECT_EQ(joined.exitCode, 0) << joined.errors;
  EXPECT_THAT(joined.errors, HasSubstr("joined as participant"));
  for (const std::string& scheme : {address_, web_}) {
    Arguments load{"load", scheme, "--token", guest, "--participants", "2", "--seconds", "0.5"};
    if (scheme != address_) load.emplace_back("--web");
    const Answer loaded = client(load);
    EXPECT_EQ(loaded.exitCode, 0) << loaded.errors;
  }
  const Answer refused = client({"pause", "small", "--server", address_, "--token", guest});
  EXPECT_EQ(refused.exitCode, 4);
  EXPECT_THAT(refused.errors, HasSubstr("requires the role owner"));
  EXPECT_EQ(client({"pause", "small", "--server", address_, "--token", owner}).exitCode, 0);

  // Keys are rotated without a restart.
  const std::string second = key("second.secret");
  const std::string next = token(second, {"--role", "viewer"});
  EXPECT_EQ(client({"list", address_, "--token", next}).exitCode, 4);
  server_->signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return client({"list", address_, "--token", next}).exitCode == 0; }));
  stopServer();
  std::ifstream in(guest);
  const std::string secret{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(server_->errors() + server_->output(), Not(HasSubstr(secret.substr(0, 40))));
  server_.reset();
}

TEST_F(IdentityProgram, PairingKeepsTheKeyOfTheServer) {
  startWith({"--pairing", "--tls", "self", "--state-dir", state()});
  if (IsSkipped()) return;
  const std::string key = server_->waitForLine("key     ", kPatience).value_or("");
  const std::string code = server_->waitForLine("pair    ", kPatience).value_or("").substr(0, 6);
  // Without a terminal, nobody can compare the key; the code is not sent.
  const Answer unknown = client({"list", address_, "--pair", code});
  EXPECT_EQ(unknown.exitCode, 4);
  EXPECT_THAT(unknown.errors, AllOf(HasSubstr("has the key " + key), HasSubstr("use it with --fingerprint")));
  const Answer paired = client({"list", address_, "--pair", code, "--fingerprint", key});
  ASSERT_EQ(paired.exitCode, 0) << paired.errors;
  const Answer again = client({"list", address_});
  EXPECT_EQ(again.exitCode, 0) << again.errors;
  // Another server at this address is noticed.
  std::filesystem::path file;
  for (const auto& entry : std::filesystem::directory_iterator(kept() + "/clothstream/servers")) file = entry;
  std::string other = key;
  other.front() = other.front() == '0' ? '1' : '0';
  std::ofstream(file) << other;
  const Answer swapped = client({"list", address_});
  EXPECT_EQ(swapped.exitCode, 4);
  EXPECT_THAT(swapped.errors, HasSubstr("is not the one expected"));
  std::ofstream(file) << "nonsense";
  EXPECT_THAT(client({"list", address_}).errors, HasSubstr("pair with the server again"));
}

TEST_F(IdentityProgram, PairsAndKeepsTheToken) {
  startWith({"--pairing", "--state-dir", state()});
  if (IsSkipped()) return;
  const std::string code = server_->waitForLine("pair    ", kPatience).value_or("").substr(0, 6);
  const std::string wrong = code == "000000" ? "000001" : "000000";
  const Answer refused = client({"list", address_, "--pair", wrong});
  EXPECT_EQ(refused.exitCode, 4);
  EXPECT_THAT(refused.errors, HasSubstr("the pairing code is wrong"));
  ASSERT_EQ(client({"list", address_, "--pair", code}).exitCode, 0);
  const Answer again = client({"join", address_, "--seconds", "0.5"});
  EXPECT_EQ(again.exitCode, 0) << again.errors;
  EXPECT_THAT(again.errors, HasSubstr("joined as owner"));
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kept() + "/clothstream/tokens")) {
    struct stat status {};
    ASSERT_EQ(::stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
    ++files;
  }
  EXPECT_EQ(files, 1u);

  const Answer made = client({"pairing-code", "--server", address_, "--role", "viewer"});
  EXPECT_EQ(made.exitCode, 0) << made.errors;
  EXPECT_THAT(made.output, HasSubstr("makes a client viewer"));
  EXPECT_EQ(client({"bans", "small", "--server", address_}).exitCode, 0);
  EXPECT_EQ(client({"ban", "small", "4711", "--server", address_}).exitCode, 4);

  // The owner gives a viewer another role, removes it, and needs the numbers that the list shows.
  Process viewer({"/usr/bin/env", "XDG_STATE_HOME=" + kept(), CLOTHSTREAM, "join", address_, "--role",
                  "viewer", "--name", "Ben", "--events"});
  ASSERT_TRUE(viewer.waitForOutput("\"joined\"", kPatience)) << viewer.errors();
  const auto listed =
      nlohmann::json::parse(client({"participants", "small", "--server", address_, "--json"}).output);
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_EQ(listed[0].at("role"), "viewer");
  const std::string number = std::to_string(listed[0].at("id").get<std::uint64_t>());
  for (int i = 0; i < 2; ++i) {
    const Answer promoted = client({"role", "small", number, "participant", "--server", address_});
    EXPECT_EQ(promoted.exitCode, 0) << promoted.errors;
  }
  EXPECT_TRUE(viewer.waitForOutput("roleChanged", kPatience)) << viewer.output();
  const Answer removed = client({"remove", "small", number, "--server", address_});
  EXPECT_EQ(removed.exitCode, 0) << removed.errors;
  EXPECT_EQ(viewer.waitForEnd(kPatience), 4) << viewer.errors();
  EXPECT_EQ(client({"role", "small", number, "owner", "--server", address_}).exitCode, 4);
  EXPECT_EQ(client({"role", "small", number, "king", "--server", address_}).exitCode, 2);
  EXPECT_EQ(client({"remove", "small", number, "--server", address_}).exitCode, 4);

  const Answer lifted = client({"unban", "small", "eve", "--server", address_});
  EXPECT_EQ(lifted.exitCode, 4);
  EXPECT_THAT(lifted.errors, HasSubstr("no such ban"));
}

TEST_F(IdentityProgram, SendsNoProofWithoutEncryption) {
  const std::string file = directory_.path() / "token";
  std::ofstream(file) << "secret";
  for (const Arguments& proof : {Arguments{"--token", file}, Arguments{"--pair", "123456"}}) {
    Arguments list{"list", "192.0.2.1:50051"};
    list.insert(list.end(), proof.begin(), proof.end());
    const Answer refused = client(list);
    EXPECT_EQ(refused.exitCode, 4);
    EXPECT_THAT(refused.errors, HasSubstr("Use https://192.0.2.1:50051"));
  }
}

TEST_F(IdentityProgram, ReloadDoesNotEndAServerThatOnlyPairs) {
  startWith({"--pairing", "--state-dir", state()});
  if (IsSkipped()) return;
  server_->signal(SIGHUP);
  server_->signal(SIGUSR1);
  EXPECT_TRUE(server_->waitForOutput("scenes in quarantine", kPatience)) << "the report, after the reload";
  EXPECT_FALSE(server_->waitForEnd(std::chrono::milliseconds(0)));
  stopServer();
  EXPECT_THAT(server_->errors(), Not(HasSubstr("read again"))) << "there are no keys";
  server_.reset();
}

TEST_F(IdentityProgram, ListensBeyondThisMachineOnlyWithADecision) {
  const auto refused = [&](Arguments options) {
    options.insert(options.begin(), {"--port", "0", "--grpc-port", "0"});
    const Answer answer = program(options);
    EXPECT_EQ(answer.exitCode, 1);
    return answer.errors;
  };
  for (const char* host : {"0.0.0.0", "::", "192.0.2.1"})
    EXPECT_THAT(refused({"--host", host}), AllOf(HasSubstr("--pairing"), HasSubstr("--insecure")));
  EXPECT_THAT(refused({"--public-name", "cloth.example.org"}),
              AllOf(HasSubstr("--public-name: cloth.example.org is reachable"), HasSubstr("--insecure")));
  EXPECT_THAT(refused({"--insecure", "--pairing"}), HasSubstr("excludes"));
  EXPECT_THAT(refused({"--pairing", "--state-dir", ""}), HasSubstr("--state-dir"));
  EXPECT_THAT(refused({"--token-keys", "/nowhere"}), HasSubstr("/nowhere"));
  EXPECT_THAT(refused({"--participants-may", "none,own"}), HasSubstr("'none' excludes"));
  EXPECT_THAT(refused({"--anonymous-role", "king"}), HasSubstr("--anonymous-role"));
  EXPECT_THAT(program({"token", "--key", key("b.pem"), "--name", std::string(200, 'x')}).errors,
              HasSubstr("its claim name"));
  EXPECT_THAT(program({"token"}).errors, HasSubstr("--key FILE"));
  EXPECT_THAT(program({"token", "--key", key("a.pem"), "--valid", "8 hours"}).errors, HasSubstr("8h"));
  startWith({"--host", "0.0.0.0", "--insecure"});
  if (IsSkipped()) return;
  EXPECT_EQ(client({"list", address_}).exitCode, 0);
  stopServer();
  EXPECT_THAT(server_->errors(), HasSubstr("everyone who reaches 0.0.0.0 can join"));
  // Debian's gRPC has published weaknesses.
  if (grpc::Version().starts_with("1.51")) {
    EXPECT_THAT(server_->errors(), HasSubstr("gRPC 1.51.1 has published weaknesses"));
  }
  startWith({"--public-name", "cloth.example.org", "--insecure"});
  EXPECT_EQ(client({"list", address_}).exitCode, 0);
  stopServer();
  EXPECT_THAT(server_->errors(), HasSubstr("everyone who reaches cloth.example.org through a program"));
  server_.reset();
}

}  // namespace
}  // namespace clothstream::e2e
