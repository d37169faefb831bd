// SPDX-License-Identifier: MIT
// The real clothstream-server with TLS, and `clothstream` as its client.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "clients/grpc/grpc_client.h"
#include "proto/tls/fingerprint.h"
#include "server/tls/certificate.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class TlsProgram : public RunningServer {
 protected:
  struct Answer {
    int exitCode = -1;
    std::string output, errors;
  };
  static Answer run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), CLOTHSTREAM);
    Process process(arguments);
    const auto code = process.waitForEnd(kPatience);
    return {code.value_or(-1), process.output(), process.errors()};
  }
  void startWith(const Arguments& more) {
    Arguments arguments = kSmallScene;
    arguments.insert(arguments.end(), more.begin(), more.end());
    startServer(arguments);
  }
  // Makes chain.pem and key.pem, which the server reads, those of the key with this name.
  void use(const std::string& name) const {
    const tls::Certificate certificate =
        tls::selfSigned(directory_.path() / name, {"localhost", "127.0.0.1"});
    std::ofstream(chain()) << certificate.chain;
    std::ofstream(key()) << certificate.key;
  }
  std::string fingerprint(const std::string& name) const {
    return fingerprintOf(tls::selfSigned(directory_.path() / name, {"localhost", "127.0.0.1"}).chain).value();
  }
  std::string chain() const { return directory_.path() / "chain.pem"; }
  std::string key() const { return directory_.path() / "key.pem"; }
  std::string state() const { return directory_.path() / "state"; }

  TemporaryDirectory directory_;
};

TEST_F(TlsProgram, ServesClientsThatKnowItsKey) {
  startWith({"--tls", "self", "--state-dir", state()});
  if (IsSkipped()) return;
  EXPECT_THAT(address_, HasSubstr("https://127.0.0.1:"));
  const std::string fingerprint = server_->waitForLine("key     ", kPatience).value_or("");
  const Answer joined = run({"join", address_, "--fingerprint", fingerprint, "--seconds", "0.5"});
  EXPECT_EQ(joined.exitCode, 0) << joined.errors;
  EXPECT_THAT(joined.output, HasSubstr("frames"));
  for (const std::string& scheme : {address_, "https://" + web_}) {
    Arguments load{"load", scheme, "--fingerprint", fingerprint, "--participants", "2", "--seconds", "0.5"};
    if (scheme != address_) load.emplace_back("--web");
    const Answer loaded = run(load);
    EXPECT_EQ(loaded.exitCode, 0) << loaded.errors;
    EXPECT_THAT(loaded.output, HasSubstr("0 dropped, 0 refused"));
  }
  const Answer listed = run({"list", address_, "--ca", state() + "/tls/self.pem"});
  EXPECT_EQ(listed.exitCode, 0) << listed.errors;

  const Answer unknown = run({"list", address_});
  EXPECT_EQ(unknown.exitCode, 4);
  EXPECT_THAT(unknown.errors, AllOf(HasSubstr("no known authority"), HasSubstr("--fingerprint")));
  std::string other = fingerprint;
  other.front() = other.front() == '0' ? '1' : '0';
  const Answer impostor = run({"list", address_, "--fingerprint", other});
  EXPECT_EQ(impostor.exitCode, 4);
  EXPECT_THAT(impostor.errors, AllOf(HasSubstr("not the one expected"), HasSubstr(fingerprint)));
}

TEST_F(TlsProgram, ReadsItsCertificateAgainWithoutEndingStreams) {
  use("first");
  startWith({"--tls-certificate", chain(), "--tls-key", key()});
  if (IsSkipped()) return;
  std::atomic<int> frames = 0;
  ServerAddress server(address_);
  server.fingerprint = fingerprint("first");
  auto joined = joinByGrpc(server, {}, [&](cs_client*, std::uint32_t events) {
    if ((events & CS_EVENT_FRAME) != 0) ++frames;
  });
  ASSERT_TRUE(joined) << joined.error().text;

  const auto lists = [&](const std::string& name) {
    return run({"list", address_, "--fingerprint", fingerprint(name)}).exitCode == 0;
  };
  // A certificate with the key of another one changes nothing.
  std::ofstream(key()) << tls::selfSigned(directory_.path() / "third", {"localhost"}).key;
  server_->signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return lists("first"); }));
  use("second");
  server_->signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return lists("second"); }));
  EXPECT_FALSE(lists("first"));
  const int before = frames;
  EXPECT_TRUE(eventually([&] { return frames >= before + 5; }));
  EXPECT_FALSE((*joined)->ended());
  joined->reset();
  stopServer();
  EXPECT_THAT(server_->errors(),
              AllOf(HasSubstr("the old certificate stays in use"), HasSubstr("is not the key")));
  server_.reset();
}

TEST_F(TlsProgram, EndsWhileItsCertificateIsAFifoWithoutAWriter) {
  use("first");
  startWith({"--tls-certificate", chain(), "--tls-key", key()});
  if (IsSkipped()) return;
  std::filesystem::remove(key());
  ASSERT_EQ(::mkfifo(key().c_str(), 0600), 0);
  server_->signal(SIGHUP);
  EXPECT_TRUE(eventually([&] {
    server_->waitForEnd(std::chrono::milliseconds(10));  // reads what it prints
    return server_->errors().find("key.pem: is not a regular file") != std::string::npos;
  }));
  stopServer();
  server_.reset();
}

TEST_F(TlsProgram, WarnsOfAKeyThatOthersMayRead) {
  use("first");
  for (const mode_t mode : {mode_t{0640}, mode_t{0600}}) {
    ASSERT_EQ(::chmod(key().c_str(), mode), 0);
    startWith({"--tls-certificate", chain(), "--tls-key", key()});
    if (IsSkipped()) return;
    stopServer();
    const auto warns = HasSubstr("--tls-key: other accounts of this machine may read " + key());
    EXPECT_EQ(testing::Value(server_->errors(), warns), mode == 0640) << server_->errors();
    server_.reset();
  }
}

TEST_F(TlsProgram, RefusesOptionsThatDoNotFit) {
  use("first");
  const auto refused = [&](const Arguments& options) {
    Arguments arguments{CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Process process(arguments);
    EXPECT_EQ(process.waitForEnd(kPatience), 1);
    return process.errors();
  };
  EXPECT_THAT(refused({"--tls-key", key()}), HasSubstr("--tls-certificate and --tls-key belong together"));
  EXPECT_THAT(refused({"--tls", "self", "--tls-certificate", chain(), "--tls-key", key()}),
              HasSubstr("excludes"));
  EXPECT_THAT(refused({"--tls-client-ca", chain()}), HasSubstr("needs TLS"));
  EXPECT_THAT(refused({"--tls", "maybe"}), HasSubstr("--tls"));
  const Answer plain = run({"list", "127.0.0.1:1", "--fingerprint", fingerprint("first")});
  EXPECT_NE(plain.exitCode, 0);
  EXPECT_THAT(plain.errors, HasSubstr("must begin with https://"));
  const Answer wrong = run({"list", "https://127.0.0.1:1", "--fingerprint", "12:34"});
  EXPECT_THAT(wrong.errors, HasSubstr("64 hexadecimal digits"));
}

}  // namespace
}  // namespace clothstream::e2e
