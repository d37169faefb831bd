// SPDX-License-Identifier: MIT
// The checks of `clothstream-server doctor`, each with a machine that is well and one that is not.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <unistd.h>

#include "server/doctor/acceptance.h"
#include "server/doctor/crowd.h"
#include "server/doctor/device.h"
#include "server/doctor/host.h"
#include "server/endpoint/datagram/udp_port.h"
#include "server/endpoint/listen/listen.h"
#include "server/messages/scene_file.h"
#include "server/tls/certificate.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

namespace fs = std::filesystem;
using doctor::Finding;
using doctor::Level;
using testing::HasSubstr;

class Doctor : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // A certificate of its own for these names, and the finding about it.
  Finding certificateFor(const std::vector<std::string>& names, const std::vector<std::string>& wanted) {
    tls::selfSigned(folder_, names);
    return doctor::checkCertificate(folder_ / "self.pem", folder_ / "self.key", wanted);
  }

  const fs::path folder_ = fs::temp_directory_path() / ("doctor" + std::to_string(getpid()));
};

TEST_F(Doctor, SeesWhetherAPortIsFree) {
  boost::asio::io_context io;
  auto other = endpoint::listen(io, "127.0.0.1", 0, "--port");
  const std::uint16_t port = other.local_endpoint().port();
  const Finding taken = doctor::checkPort("127.0.0.1", port, "--port");
  EXPECT_EQ(taken.level, Level::problem);
  EXPECT_THAT(taken.text, HasSubstr("already in use"));
  EXPECT_THAT(taken.fix, HasSubstr("--port"));
  other.close();
  EXPECT_EQ(doctor::checkPort("127.0.0.1", port, "--port").level, Level::good);
  EXPECT_EQ(doctor::checkPort("127.0.0.1", 0, "--port").level, Level::good);
  EXPECT_EQ(doctor::checkPort("203.0.113.1", port, "--port").level, Level::problem);
}

TEST_F(Doctor, SeesWhetherTheDatagramPortIsFree) {
  boost::asio::io_context io;
  auto other = std::make_unique<endpoint::UdpPort>(io, "127.0.0.1", 0);
  const endpoint::DatagramEndpointOptions options{.host = "127.0.0.1",
                                                  .port = other->port(),
                                                  .ownAddresses = {"192.0.2.1"},
                                                  .publicAddresses = {"203.0.113.5", "2001:db8::1"}};
  const doctor::Findings taken = doctor::checkDatagramPort(options, false);
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(taken[0].level, Level::advice);
  EXPECT_THAT(taken[0].text, HasSubstr("already in use; choose another with --datagram-port; clients stay"));
  EXPECT_EQ(doctor::checkDatagramPort(options, true).at(0).level, Level::problem);
  other.reset();
  const doctor::Findings free = doctor::checkDatagramPort(options, true);
  ASSERT_EQ(free.size(), 2u);
  EXPECT_EQ(free[0].level, Level::good);
  EXPECT_THAT(free[0].text, HasSubstr("(gRPC: 192.0.2.1), and --public-address (203.0.113.5, 2001:db8::1)"));
  EXPECT_EQ(free[0].figures["ownAddresses"][0], "192.0.2.1");
  EXPECT_GT(free[1].figures["receiveBytes"].get<int>(), 0);
}

TEST_F(Doctor, SeesShortUdpQueues) {
  constexpr int kWanted = endpoint::UdpPort::kQueueBytes;
  EXPECT_EQ(doctor::checkUdpQueues(kWanted, kWanted).level, Level::good);
  const Finding tooShort = doctor::checkUdpQueues(212'992, kWanted);
  EXPECT_EQ(tooShort.level, Level::advice);
  EXPECT_THAT(tooShort.text, HasSubstr("208 kB for arriving, 4096 kB for leaving"));
  EXPECT_THAT(tooShort.fix, HasSubstr("net.core.rmem_max=4194304"));
  EXPECT_EQ(doctor::checkUdpQueues(kWanted, 212'992).level, Level::advice);
}

TEST_F(Doctor, SeesTheDaysAndNamesOfACertificate) {
  const Finding good = certificateFor({"cloth.example", "127.0.0.1"}, {"cloth.example", "*"});
  EXPECT_EQ(good.level, Level::good) << good.text;
  EXPECT_THAT(good.figures["names"], testing::UnorderedElementsAre("cloth.example", "127.0.0.1"));
  EXPECT_GT(good.figures["daysLeft"].get<double>(), 30);
  const Finding other = certificateFor({"cloth.example"}, {"other.example"});
  EXPECT_EQ(other.level, Level::problem);
  EXPECT_THAT(other.text, HasSubstr("not for other.example"));
}

TEST_F(Doctor, SeesACertificateThatCannotBeRead) {
  const Finding finding = doctor::checkCertificate(folder_ / "none.pem", folder_ / "none.key", {});
  EXPECT_EQ(finding.level, Level::problem);
  EXPECT_THAT(finding.text, HasSubstr("none.pem"));
}

TEST_F(Doctor, SeesWhetherADirectoryCanBeWrittenAndHasRoom) {
  const Finding good = doctor::checkDirectory(folder_ / "not" / "there" / "yet", "--state-dir", 0);
  EXPECT_EQ(good.level, Level::good) << good.text;
  EXPECT_FALSE(fs::exists(folder_ / "not"));
  const Finding full = doctor::checkDirectory(folder_, "--state-dir", 1e12);
  EXPECT_EQ(full.level, Level::problem);
  EXPECT_THAT(full.text, HasSubstr("--keep-free"));
  std::ofstream(folder_ / "file") << "x";
  EXPECT_EQ(doctor::checkDirectory(folder_ / "file", "--state-dir", 0).level, Level::problem);
}

TEST_F(Doctor, SeesCongestionControl) {
  EXPECT_EQ(doctor::checkCongestionControl("bbr").level, Level::good);
  const Finding other = doctor::checkCongestionControl("cubic");
  EXPECT_EQ(other.level, Level::advice);
  EXPECT_EQ(other.figures["congestionControl"], "cubic");
  EXPECT_THAT(other.text, HasSubstr("use cubic"));
  EXPECT_THAT(other.fix, HasSubstr("modprobe tcp_bbr"));
  EXPECT_EQ(doctor::checkCongestionControl("").level, Level::advice);
}

TEST_F(Doctor, PrintsLevelTopicTextAndFix) {
  const doctor::Findings findings = {
      {.level = Level::good, .topic = "clock", .text = "right"},
      {.level = Level::problem, .topic = "port", .text = "taken", .fix = "free it"}};
  EXPECT_EQ(doctor::toText(findings),
            "ok       clock        right\nproblem  port         taken\n                      free it\n");
  EXPECT_EQ(doctor::toJson(findings).dump(),
            R"([{"level":"ok","topic":"clock","text":"right"},)"
            R"({"level":"problem","topic":"port","text":"taken","fix":"free it"}])");
  EXPECT_TRUE(doctor::hasProblem(findings));
  EXPECT_FALSE(doctor::hasProblem({findings.front()}));
}

// A millisecond of the device for all scenes and a tenth for each, and a twentieth of a processor for a
// frame.
constexpr doctor::CrowdCost kCost{.sharedSeconds = 1e-3, .ownSeconds = 1e-4, .frameSeconds = 5e-5};

TEST(CrowdEstimate, DeviceLimitsManyProcessors) {
  // 8 ms of a tick of 10 ms: the kernel calls, and 70 scenes.
  const auto carried = doctor::carriedScenes(kCost, {.processors = 16}, 100);
  EXPECT_NEAR(carried.count, 70, 1);
  EXPECT_FALSE(carried.byProcessors);
}

TEST(CrowdEstimate, OneProcessorLimitsAFastDevice) {
  doctor::CrowdCost cost = kCost;
  cost.ownSeconds = 1e-6;
  // 8 ms of a tick for frames.
  const auto carried = doctor::carriedScenes(cost, {.processors = 1}, 100);
  EXPECT_NEAR(carried.count, 160, 1);
  EXPECT_TRUE(carried.byProcessors);
}

TEST(CrowdEstimate, SoftwareDeviceSharesTheProcessors) {
  // 7 ms of a tick, of which each scene takes 0.1 ms on the device and 0.025 ms for its frame.
  const auto carried = doctor::carriedScenes(kCost, {.processors = 2, .software = true}, 100);
  EXPECT_NEAR(carried.count, 56, 1);
  EXPECT_TRUE(carried.byProcessors);
}

TEST(CrowdEstimate, NoSceneFitsATooSlowDevice) {
  EXPECT_EQ(doctor::carriedScenes(kCost, {.processors = 16}, 1000).count, 0u);
}

TEST(CrowdEstimate, KernelCallsAreShared) {
  const model::Work work{.nodeSteps = 1000, .gpuDispatches = 10, .dispatches = 20};
  model::DeviceSpeed speed{.nodeStepSeconds = 1e-8, .dispatchSeconds = 1e-5};
  const doctor::CrowdCost cost = doctor::costOf(work, speed, 0.25);
  EXPECT_DOUBLE_EQ(cost.sharedSeconds, 20e-5);
  EXPECT_DOUBLE_EQ(cost.ownSeconds, work.seconds(speed) - 20e-5);
  EXPECT_NEAR(cost.ownSeconds, 1e-5, 1e-12);
  EXPECT_EQ(cost.frameSeconds, 0.25);
  speed.gpu = true;
  EXPECT_DOUBLE_EQ(doctor::costOf(work, speed, 0).sharedSeconds, 30e-5);
}

class DoctorOfDevices : public GpuTest {
 protected:
  static vulkan::DeviceOptions options(std::uint32_t) { return {.validation = true}; }
};

TEST_F(DoctorOfDevices, NamesTheDeviceThatTheServerUses) {
  const doctor::Findings findings = doctor::checkDevices({});
  ASSERT_GE(findings.size(), 2u);
  EXPECT_EQ(findings.back().figures["name"], device().info().name);
  EXPECT_EQ(findings.back().level, device().isSoftware() ? Level::advice : Level::good);
  const doctor::Findings none = doctor::checkDevices({.select = "no such device"});
  EXPECT_TRUE(doctor::hasProblem(none));
}

TEST_F(DoctorOfDevices, MeasuresWhatADeviceCarries) {
  const doctor::Findings findings = doctor::measureCapacity(options, std::chrono::milliseconds(300));
  ASSERT_EQ(findings.size(), 2u);
  for (const Finding& finding : findings) {
    const auto& ticks = finding.figures["ticks"];
    ASSERT_FALSE(ticks.empty());
    EXPECT_EQ(ticks[0]["size"], 32);
    EXPECT_GT(ticks[0]["tickMs"].get<double>(), 0);
  }
}

TEST_F(DoctorOfDevices, EstimatesWhatTheMachineCarries) {
  const doctor::Findings findings = doctor::estimateCrowds(options);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].figures["vertices"], 1024);
  EXPECT_EQ(findings[1].figures["vertices"], 10'000);
  for (const Finding& finding : findings) {
    EXPECT_THAT(finding.text, HasSubstr("estimate"));
    EXPECT_GT(finding.figures["deviceUsOfScene"].get<double>(), 0);
    EXPECT_GT(finding.figures["processorUsOfFrame"].get<double>(), 0);
  }
  EXPECT_GE(findings[0].figures["scenes"], findings[1].figures["scenes"]);
}

TEST_F(DoctorOfDevices, AcceptsADeviceWithTheRightStatesAlone) {
  const auto states = doctor::acceptedStates();
  const auto small = std::ranges::find(states, "figure_11", &doctor::AcceptedState::scene);
  ASSERT_NE(small, states.end());
  const auto never = [] { return false; };
  EXPECT_EQ(doctor::accept(options, *small, never).level, Level::good);
  const Finding wrong = doctor::accept(options, {small->scene, small->hash ^ 1}, never);
  EXPECT_EQ(wrong.level, Level::problem);
  EXPECT_FALSE(wrong.fix.empty());
  EXPECT_THROW(doctor::accept(options, *small, [] { return true; }), std::runtime_error);
}

// Expects that the device reaches the accepted states of those scenes for which `chosen` is true.
template <typename Chosen>
void expectAcceptedStates(Chosen chosen) {
  const auto unchecked = [](std::uint32_t) { return vulkan::DeviceOptions(); };
  int scenes = 0;
  for (const doctor::AcceptedState& state : doctor::acceptedStates()) {
    if (!chosen(state.scene)) continue;
    EXPECT_EQ(doctor::accept(unchecked, state, [] { return false; }).level, Level::good) << state.scene;
    ++scenes;
  }
  EXPECT_GT(scenes, 0);
}

// Five minutes on two processors.
TEST_F(DoctorOfDevices, ReachesEveryAcceptedState) {
  expectAcceptedStates([](std::string_view scene) { return scene != "gown"; });
}

// About ten minutes on two processors.
TEST_F(DoctorOfDevices, ReachesTheAcceptedStateOfTheGown) {
  expectAcceptedStates([](std::string_view scene) { return scene == "gown"; });
}

TEST_F(DoctorOfDevices, AcceptsStatesOfSharedKernels) {
  const auto states = doctor::acceptedStates();
  const auto small = std::ranges::find(states, "figure_11", &doctor::AcceptedState::scene);
  ASSERT_NE(small, states.end());
  const doctor::OptionsFor sharing = [](std::uint32_t nodes) {
    vulkan::DeviceOptions device = options(nodes);
    device.sharing = vulkan::KernelSharing::always;
    return device;
  };
  EXPECT_EQ(doctor::accept(sharing, *small, [] { return false; }).level, Level::good);
}

TEST(AcceptedStates, AreThoseOfAllBuiltInScenes) {
  std::vector<std::string> names;
  for (const doctor::AcceptedState& state : doctor::acceptedStates()) names.emplace_back(state.scene);
  EXPECT_THAT(names, testing::UnorderedElementsAreArray(messages::namedScenes()));
}

}  // namespace
}  // namespace clothstream::tests
