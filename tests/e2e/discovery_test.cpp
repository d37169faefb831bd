// SPDX-License-Identifier: MIT
// `clothstream discover` finds a real server through a real Avahi daemon, in a network namespace.
#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/e2e/process.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using ::testing::HasSubstr;

class Discovery : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("unshare --net --mount-proc --pid --fork ip link add home type veth peer name other "
                    "2>/dev/null") != 0)
      GTEST_SKIP() << "network namespaces with virtual links are not permitted here";
  }

  // Runs the shell script in the network. Variables: $server and $client are the programs, $state is a
  // directory for the server.
  std::string run(const std::string& script) {
    const std::string state = directory_.path() / "state";
    const std::string variables =
        "server=" CLOTHSTREAM_SERVER "; client=" CLOTHSTREAM "; state=" + state + "; ";
    Process process(
        {"tests/e2e/discovery_network.sh", directory_.path(), "bash", "-euc", variables + script});
    const auto code = process.waitForEnd(kPatience);
    EXPECT_EQ(code, 0) << process.output() << process.errors();
    return process.output();
  }

  // Starts a server with these options, and waits for its announcement. Its process id is in the variable
  // `log`, its output in $state.`log`.
  static std::string startServer(const std::string& options, const std::string& log) {
    return "$server --scene small --scene-file tests/e2e/small.json --port 0 --grpc-port 0 --host 0.0.0.0 "
           "--insecure "
           "--state-dir $state." +
           log + "_kept " + options + " >$state." + log + " 2>&1 & " + log +
           "=$!; until grep -q 'announced by mDNS as' $state." + log + "; do kill -0 $! || { cat $state." +
           log + "; exit 1; }; sleep 0.05; done; ";
  }

  TemporaryDirectory directory_;
};

TEST_F(Discovery, FindsServersWithAddressPortsAndKey) {
  const std::string output = run(startServer("--tls self", "first") + startServer("--announce on", "second") +
                                 "grep -E '^(page|gRPC|key) ' $state.first; "
                                 "echo FOUND; $client discover --json; "
                                 "fingerprint=$(sed -n 's/^key *//p' $state.first); "
                                 "address=$($client discover | sed -n 's/.*join \\(https.*\\)/\\1/p'); "
                                 "echo LISTED; $client list $address --fingerprint $fingerprint; "
                                 "kill $first $second; wait $first $second; "
                                 // Other machines may remember the announcement for a second.
                                 "until [ \"$($client discover --json)\" = '[]' ]; do sleep 0.1; done");
  const std::size_t found = output.find("FOUND\n"), listed = output.find("LISTED\n");
  ASSERT_TRUE(found != std::string::npos && listed != std::string::npos) << output;
  const auto servers = nlohmann::json::parse(output.substr(found + 6, listed - found - 6));
  ASSERT_EQ(servers.size(), 2u) << output;
  const auto& encrypted = servers[0];
  EXPECT_EQ(encrypted["name"], "ClothStream on workshop");
  EXPECT_THAT(encrypted["version"], HasSubstr("clothstream-server "));
  const auto portAfter = [&](const std::string& line) {
    const std::size_t at = output.find(':', output.find("//", output.find(line)));
    return std::to_string(std::stoi(output.substr(at + 1)));
  };
  EXPECT_EQ(encrypted["page"], "https://192.0.2.2:" + portAfter("page ") + "/");
  EXPECT_EQ(encrypted["address"], "https://192.0.2.2:" + portAfter("gRPC "));
  EXPECT_THAT(output.substr(0, found), HasSubstr("key     " + encrypted["fingerprint"].get<std::string>()));
  // Two servers of one machine have different names.
  EXPECT_EQ(servers[1]["name"], "ClothStream on workshop #2");
  EXPECT_THAT(servers[1]["page"], HasSubstr("http://192.0.2.2:"));
  EXPECT_EQ(servers[1]["fingerprint"], "");
  EXPECT_THAT(output.substr(listed), HasSubstr("small"));
}

TEST_F(Discovery, AnnouncesAgainAfterTheDaemonRestarts) {
  const std::string output = run(
      startServer("--announce on", "log") +
      "pid=$(cat $(dirname $state)/avahi.pid); kill $pid; while kill -0 $pid 2>/dev/null; do sleep 0.05; "
      "done; "
      "until grep -q 'until avahi-daemon runs' $state.log; do sleep 0.05; done; "
      "avahi-daemon --file=$(dirname $state)/avahi.conf --no-drop-root --no-rlimits --no-chroot 2>/dev/null "
      "& "
      "until [ $(grep -c 'announced by mDNS as' $state.log) = 2 ]; do sleep 0.05; done; $client discover");
  EXPECT_THAT(output, HasSubstr("ClothStream on workshop"));
}

TEST_F(Discovery, NamesTheMissingDaemon) {
  const std::string output = run(
      "kill $(cat $(dirname $state)/avahi.pid); code=0; $client discover 2>&1 || code=$?; echo code $code");
  EXPECT_THAT(output, HasSubstr("install and start avahi-daemon"));
  EXPECT_THAT(output, HasSubstr("code 3"));
}

}  // namespace
}  // namespace clothstream::e2e
