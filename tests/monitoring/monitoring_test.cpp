// SPDX-License-Identifier: MIT
// The endpoint for operators, scraped while a client streams.
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <regex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <prometheus/text_serializer.h>

#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/monitoring/connection_room.h"
#include "server/monitoring/metric_families.h"
#include "server/monitoring/monitoring_endpoint.h"
#include "server/monitoring/process_usage.h"
#include "server/scene/journal.h"
#include "tests/endpoint/client.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/web_client.h"
#include "tests/monitoring/exposition.h"
#include "tests/serving/small_scene.h"
#include "tests/support/eventually.h"

namespace clothstream::tests {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const MetricLabels kSmall{{"scene", "small"}};

Response get(const monitoring::MonitoringEndpoint& endpoint, const std::string& target,
             const std::string& method = "GET") {
  return HttpClient(endpoint.port()).get(target, "", method);
}

class MonitoringTest : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    endpoint::WebEndpointOptions webOptions;
    webOptions.port = 0;
    web_ = std::make_unique<endpoint::WebEndpoint>(server(), webOptions);
    monitoring_ = std::make_unique<monitoring::MonitoringEndpoint>(monitoring::MonitoringOptions{
        .version = "1.2.3", .deviceSilence = silence(), .metricsLifetime = 0ms});
    monitoring_->started(server());
  }
  void TearDown() override {
    web_.reset();
    monitoring_.reset();
    SmallServer::TearDown();
  }
  virtual std::chrono::milliseconds silence() const { return 5s; }

  Response get(const std::string& target) { return tests::get(*monitoring_, target); }
  Exposition scrape() {
    const Response response = get("/metrics");
    EXPECT_EQ(response.result(), http::status::ok);
    EXPECT_EQ(std::string(response[http::field::content_type]), "text/plain; version=0.0.4; charset=utf-8");
    return Exposition(response.body());
  }
  std::unique_ptr<WebSocketClient> connect() { return std::make_unique<WebSocketClient>(web_->port()); }
  // Returns when a frame shows the collider.
  static void poseCollider(Joined& joined) {
    joined.client->send(colliderPose(0.1f));
    const std::uint64_t participant = joined.viewer.welcome.participant_id();
    ASSERT_TRUE(joined.seeUntil([&] { return joined.viewer.colliderOf(participant).has_value(); }));
  }
  void pause() {
    v1::ControlSceneRequest request;
    request.set_name("small");
    request.set_paused(true);
    ASSERT_TRUE(server().unaryCalls.controlScene(request));
  }

  std::unique_ptr<endpoint::WebEndpoint> web_;
  std::unique_ptr<monitoring::MonitoringEndpoint> monitoring_;
};

// Spans of one track never overlap, those of the device have the names of the stages, and those of packets
// the ticks of the frames that the client got.
TEST_F(MonitoringTest, TraceShowsTicksStagesAndPackets) {
  Joined joined(connect());
  ASSERT_TRUE(joined.see(30));
  const Response response = get("/trace?seconds=60");
  EXPECT_EQ(response.result(), http::status::ok);
  EXPECT_EQ(std::string(response[http::field::content_type]), "application/json");
  const nlohmann::json trace = nlohmann::json::parse(response.body());
  std::map<std::string, int> processes;
  for (const nlohmann::json& event : trace["traceEvents"])
    if (event["name"] == "process_name") processes[event["args"]["name"]] = event["pid"];
  ASSERT_TRUE(processes.contains("small"));
  std::map<int, double> ends;
  std::map<int, std::set<std::string>> names;
  std::set<std::uint64_t> packets;
  for (const nlohmann::json& event : trace["traceEvents"]) {
    if (event["ph"] != "X" || event["pid"] != processes["small"]) continue;
    const int track = event["tid"];
    const double start = event["ts"], length = event["dur"];
    EXPECT_GE(length, 0);
    // Times are doubles of microseconds since the machine started.
    if (track == 0) {
      EXPECT_GE(start, ends[track] - 1) << event;
    }
    ends[track] = start + length;
    names[track].insert(event["name"]);
    if (track == 2) packets.insert(event["args"]["tick"].get<std::uint64_t>());
  }
  EXPECT_THAT(names[0], testing::ElementsAre("record", "wait for the device"));
  EXPECT_THAT(names[1], testing::Contains("advance"));
  EXPECT_THAT(names[2], testing::Contains("encode a key frame"));
  EXPECT_GE(packets.size(), 30u);
  EXPECT_TRUE(packets.contains(joined.viewer.tick()));
  for (const char* wrong : {"/trace?seconds=0", "/trace?seconds=61", "/trace?seconds=", "/trace?seconds=1x"})
    EXPECT_EQ(get(wrong).result(), http::status::bad_request) << wrong;
  EXPECT_EQ(get("/traces").result(), http::status::not_found);
}

TEST_F(MonitoringTest, MetricsAgreeWithWhatTheClientReceived) {
  Joined joined(connect());
  poseCollider(joined);
  ASSERT_TRUE(joined.see(20));
  joined.client->send(garbage(10));
  ASSERT_TRUE(joined.seeUntil([&] { return !joined.viewer.errors.empty(); }));
  const Exposition during = scrape();
  EXPECT_EQ(during.value("clothstream_scene_running", kSmall), 1);
  EXPECT_EQ(during.value("clothstream_scene_participants", kSmall), 1);
  EXPECT_EQ(during.value("clothstream_scene_subscribers", kSmall), 1);
  EXPECT_EQ(during.value("clothstream_scene_participants", {{"scene", "other"}}), 0);
  EXPECT_EQ(during.value("clothstream_scene_rejected_messages_total", kSmall), 1);
  EXPECT_EQ(during.value("clothstream_open_connections"), 1);
  EXPECT_EQ(during.value("clothstream_connections_total"), 1);
  EXPECT_EQ(during.value("clothstream_scenes"), 3);
  EXPECT_EQ(
      during.value("clothstream_build_info", {{"version", "1.2.3"}, {"device", server().device.info().name}}),
      1);

  // At rest, the numbers are exact.
  pause();
  const auto taken = [&] {
    return static_cast<std::uint64_t>(scrape().value("clothstream_scene_taken_frames_total", kSmall));
  };
  ASSERT_TRUE(eventually([&] { return scrape().value("clothstream_scene_running", kSmall) == 0; }));
  std::uint64_t sent = taken();
  ASSERT_TRUE(eventually([&] {
    joined.seeUntil([&] { return joined.viewer.frames >= sent; });
    sent = taken();
    return joined.viewer.frames == sent;
  }));
  const Exposition atRest = scrape();
  const auto of = [&](const std::string& name, const MetricLabels& labels = kSmall) {
    return atRest.value("clothstream_scene_" + name, labels);
  };
  EXPECT_GE(of("frames_total"), static_cast<double>(sent));
  EXPECT_EQ(of("encode_seconds_count"), of("frames_total"));
  EXPECT_EQ(of("send_seconds_count"), static_cast<double>(sent));
  EXPECT_GE(of("key_frames_total"), 1);
  EXPECT_GT(of("packet_bytes_total"), 10 * of("frames_total"));
  EXPECT_GE(of("ticks_total"), static_cast<double>(joined.viewer.tick()));
  EXPECT_EQ(of("tick_seconds_count"), of("ticks_total"));
  EXPECT_EQ(of("device_seconds_count"), of("ticks_total"));
  EXPECT_EQ(of("tick_lateness_seconds_count"), of("ticks_total"));
  EXPECT_GE(of("input_to_packet_seconds_count"), 1);
  EXPECT_EQ(of("paused"), 1);
  EXPECT_EQ(of("joins_total"), 1);
  EXPECT_EQ(of("waiting_changes"), 0);
  EXPECT_EQ(atRest.find("clothstream_scene_tick_seconds_count", {{"scene", "other"}}), std::nullopt)
      << "a histogram without records has no samples";
  EXPECT_GE(of("device_stage_seconds_count", {{"scene", "small"}, {"stage", "advance"}}), of("ticks_total"));
  EXPECT_GT(atRest.value("clothstream_device_memory_bytes"), 8 * 8 * 32);
  EXPECT_GE(atRest.value("clothstream_device_reserved_memory_bytes"),
            atRest.value("clothstream_device_memory_bytes"));
  EXPECT_LT(atRest.value("clothstream_device_silence_seconds"), 5);
  EXPECT_GE(atRest.value("clothstream_sent_bytes_total", {{"endpoint", "web"}}),
            of("packet_bytes_total") / 2);
  EXPECT_EQ(atRest.value("clothstream_sent_bytes_total", {{"endpoint", "grpc"}}), 0);
  EXPECT_GT(of("price"), 0);
  EXPECT_FLOAT_EQ(static_cast<float>(of("price")),
                  static_cast<float>(server().scenes.find("small")->price()));

  joined.client->leave();
  EXPECT_TRUE(eventually([&] { return scrape().value("clothstream_open_connections") == 0; }));
  EXPECT_EQ(scrape().value("clothstream_scene_participants", kSmall), 0);
}

TEST_F(MonitoringTest, BudgetIsUsedByCreatedScenes) {
  const auto used = [&](const std::string& what) {
    return scrape().value("clothstream_budget_used_" + what);
  };
  const auto freed = [&](const std::string& what) {
    return scrape().value("clothstream_budget_free_" + what);
  };
  const double before = used("memory_bytes"), load = used("load"), free = freed("memory_bytes");
  v1::CreateSceneRequest request;
  request.set_named("large");
  request.set_name("copy");
  std::promise<bool> made;
  server().unaryCalls.createScene(request, [&](const auto& answer) { made.set_value(answer.has_value()); });
  ASSERT_TRUE(made.get_future().get());
  EXPECT_GT(used("memory_bytes"), before + 128 * 128 * 12);
  EXPECT_GT(used("load"), load);
  EXPECT_LT(freed("memory_bytes"), free);
}

TEST_F(MonitoringTest, MetricsOfADeletedSceneVanish) {
  const auto deviceMemory = [&] { return scrape().value("clothstream_device_memory_bytes"); };
  double before = 0;
  ASSERT_TRUE(eventually([&] { return (before = deviceMemory()) > 0; }));
  v1::CreateSceneRequest create;
  create.set_named("small");
  create.set_name("mine");
  std::promise<bool> created, deleted;
  server().unaryCalls.createScene(create, [&](const auto& made) { created.set_value(made.has_value()); });
  ASSERT_TRUE(created.get_future().get());
  // The device thread publishes the memory before it waits for work again, so shortly after its answer.
  EXPECT_TRUE(eventually([&] { return deviceMemory() > before; }));
  EXPECT_TRUE(scrape().hasLabel("scene", "mine"));
  EXPECT_EQ(scrape().value("clothstream_scenes"), 4);
  v1::DeleteSceneRequest remove;
  remove.set_name("mine");
  server().unaryCalls.deleteScene(remove, [&](const auto& done) { deleted.set_value(done.has_value()); });
  ASSERT_TRUE(deleted.get_future().get());
  EXPECT_FALSE(scrape().hasLabel("scene", "mine"));
  EXPECT_TRUE(eventually([&] { return deviceMemory() == before; }));
}

TEST_F(MonitoringTest, CountsDevicesThatWereRebuilt) {
  Joined joined(connect());
  server().device.simulateDeviceLoss();
  EXPECT_TRUE(eventually([&] { return scrape().value("clothstream_device_rebuilds_total") == 1; }));
  EXPECT_TRUE(eventually([&] { return get("/healthz").result() == http::status::ok; }));
}

TEST_F(MonitoringTest, CountsRefusedConnectionsByReason) {
  server().stop();
  WebSocketClient refused(web_->port());
  refused.send(hello());
  while (refused.receive()) {
  }
  const Exposition read = scrape();
  EXPECT_EQ(read.value("clothstream_refusals_total", {{"reason", "stopping"}}), 1);
  EXPECT_EQ(read.value("clothstream_refusals_total", {{"reason", "connections"}}), 0);
}

TEST_F(MonitoringTest, ReadinessFollowsStartAndStop) {
  EXPECT_EQ(get("/readyz").result(), http::status::ok);
  monitoring_->stopping();
  EXPECT_EQ(get("/readyz").result(), http::status::service_unavailable);
  EXPECT_THAT(get("/readyz").body(), HasSubstr("stopping"));
  EXPECT_EQ(get("/healthz").result(), http::status::ok);
  EXPECT_EQ(scrape().value("clothstream_scenes"), 3) << "the metrics are still served";
  monitoring_->stopped();
  EXPECT_EQ(get("/readyz").result(), http::status::service_unavailable);
  EXPECT_FALSE(scrape().families().contains("clothstream_scenes"));
}

// The table of docs/monitoring.md has each metric's name, type, labels and help.
TEST_F(MonitoringTest, DocumentationListsTheServedMetrics) {
  Joined joined(connect());
  poseCollider(joined);
  std::map<std::string, std::vector<std::string>> documented, served;
  std::ifstream page("docs/monitoring.md");
  ASSERT_TRUE(page) << "run the tests in the root of the repository";
  const std::regex row(R"(\| `(clothstream_\w+)` \| (\w+) \| ([^|]*) \| ([^|]*) \|)");
  std::smatch match;
  for (std::string line; std::getline(page, line);)
    if (std::regex_match(line, match, row)) documented[match[1]] = {match[2], match[3], match[4]};
  const Exposition read = scrape();
  for (const auto& [name, family] : read.families()) {
    ASSERT_FALSE(family.samples.empty()) << name;
    std::string labels;
    for (const auto& [label, value] : family.samples.front().labels)
      if (label != "le") labels += (labels.empty() ? "" : ", ") + label;
    served[name] = {family.type, labels, family.help};
  }
  EXPECT_EQ(documented, served);
}

TEST_F(MonitoringTest, RefusesUnknownPathsMethodsBodiesAndNames) {
  EXPECT_EQ(get("/").result(), http::status::not_found);
  EXPECT_EQ(get("/metrics?x=1").result(), http::status::ok);
  EXPECT_EQ(tests::get(*monitoring_, "/metrics", "POST").result(), http::status::method_not_allowed);
  const Response head = tests::get(*monitoring_, "/healthz", "HEAD");
  EXPECT_EQ(head.result(), http::status::ok);
  EXPECT_EQ(std::string(head[http::field::content_length]), "3");
  HttpClient body(monitoring_->port());
  body.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n" +
            std::string(20'000, 'x'));
  EXPECT_EQ(body.readResponse().result(), http::status::payload_too_large);
  HttpClient encoded(monitoring_->port());
  encoded.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: xchunked\r\n\r\n");
  EXPECT_EQ(encoded.readResponse().result(), http::status::payload_too_large);
  HttpClient foreign(monitoring_->port());
  foreign.send("GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(foreign.readResponse().result(), http::status::misdirected_request);
  HttpClient binary(monitoring_->port());
  binary.send("\x16\x03\x01 this is no HTTP\r\n\r\n");
  EXPECT_EQ(binary.readResponse().result(), http::status::bad_request);
  EXPECT_TRUE(binary.closes());
}

TEST_F(MonitoringTest, CutsHugeAndSlowRequests) {
  HttpClient huge(monitoring_->port());
  huge.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\nX-Huge: " + std::string(9'000, 'x') + "\r\n\r\n");
  EXPECT_EQ(huge.readResponse().result(), http::status::request_header_fields_too_large);
  EXPECT_TRUE(huge.closes());

  // Bytes that arrive one by one do not extend the time of a request.
  HttpClient slow(monitoring_->port());
  const auto start = std::chrono::steady_clock::now();
  const std::string request = "GET /metrics HTTP/1.1\r\nHost: localhost\r\nX-Slow: ";
  slow.send(request);
  bool cut = false;
  while (!cut && std::chrono::steady_clock::now() - start < kPatience) {
    std::this_thread::sleep_for(200ms);
    try {
      slow.send("x");
    } catch (const ClientError&) {
      cut = true;
    }
  }
  EXPECT_TRUE(cut);
  EXPECT_EQ(get("/healthz").result(), http::status::ok);
}

// Someone who holds connections open must not make the server look dead.
TEST_F(MonitoringTest, AnswersWhileOthersHoldConnections) {
  std::vector<std::unique_ptr<HttpClient>> held;
  for (int i = 0; i < 40; ++i) {
    held.push_back(std::make_unique<HttpClient>(monitoring_->port()));
    held.back()->send("GET /healthz HTTP/1.1\r\n");
  }
  for (const char* path : {"/healthz", "/readyz", "/metrics"})
    EXPECT_EQ(get(path).result(), http::status::ok) << path;
  EXPECT_TRUE(held.front()->closes()) << "the oldest one makes place";
  held.back()->send("Host: localhost\r\n\r\n");
  EXPECT_EQ(held.back()->readResponse().result(), http::status::ok) << "newer ones are still served";
}

TEST(ConnectionRoom, EndsTheOldestOfTheAddressWithTheMost) {
  monitoring::ConnectionRoom<const int> room;
  std::vector<int> many(15), later(3);
  const int one = 0;
  EXPECT_EQ(room.add(one, "192.0.2.1"), nullptr);
  for (const int& each : many) EXPECT_EQ(room.add(each, "192.0.2.2"), nullptr);
  EXPECT_EQ(room.add(later[0], "192.0.2.1"), &many[0]);
  EXPECT_EQ(room.add(later[1], "192.0.2.3"), &many[1]);
  room.remove(one);
  room.remove(many[0]);  // ended before
  EXPECT_EQ(room.add(later[2], "192.0.2.2"), nullptr);
  EXPECT_EQ(room.add(one, "192.0.2.2"), &many[2]);
}

TEST(MonitoringStart, AnswersBeforeThereIsAServer) {
  const monitoring::MonitoringEndpoint endpoint({.version = "1.2.3"});
  const Response ready = get(endpoint, "/readyz");
  EXPECT_EQ(ready.result(), http::status::service_unavailable);
  EXPECT_THAT(ready.body(), HasSubstr("starting"));
  EXPECT_EQ(get(endpoint, "/healthz").result(), http::status::ok);
  const Exposition read(get(endpoint, "/metrics").body());
  EXPECT_EQ(read.value("clothstream_build_info", {{"version", "1.2.3"}, {"device", ""}}), 1);
  EXPECT_GT(read.value("clothstream_process_resident_memory_bytes"), 1'000'000);
}

TEST(MonitoringStart, ServesRecentMetricsAgain) {
  const auto descriptors = [](const monitoring::MonitoringEndpoint& endpoint) {
    return Exposition(get(endpoint, "/metrics").body()).value("clothstream_process_open_descriptors");
  };
  const monitoring::MonitoringEndpoint keeping({.metricsLifetime = 1h}), building({.metricsLifetime = 0ms});
  const double before = descriptors(keeping), beforeToo = descriptors(building);
  std::vector<std::ifstream> files;
  for (int i = 0; i < 10; ++i) files.emplace_back("/proc/self/status");
  EXPECT_EQ(descriptors(keeping), before);
  EXPECT_GE(descriptors(building), beforeToo + 5);
}

TEST(MonitoringStart, NamesPortAndOptionWhenThePortIsInUse) {
  const monitoring::MonitoringEndpoint first({});
  try {
    const monitoring::MonitoringEndpoint second({.port = first.port()});
    FAIL() << "two endpoints have the same port";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(HasSubstr(std::to_string(first.port())), HasSubstr("--metrics-port")));
  }
  EXPECT_THROW(monitoring::MonitoringEndpoint({.host = "192.0.2.1"}), std::runtime_error);
}

TEST(ProcessUsage, FollowsDescriptorsAndThreads) {
#ifdef __SANITIZE_THREAD__
  constexpr std::uint64_t own = 2;  // The sanitizer starts its own thread at the first one.
#else
  constexpr std::uint64_t own = 1;
#endif
  std::thread([] {}).join();
  // The system counts a thread for a moment after join() has returned.
  ASSERT_TRUE(eventually([&] { return monitoring::processUsage().threads == own; }));
  const monitoring::ProcessUsage before = monitoring::processUsage();
  std::vector<std::ifstream> files;
  for (int i = 0; i < 10; ++i) files.emplace_back("/proc/self/status");
  std::promise<void> end;
  std::thread thread([done = end.get_future()]() mutable { done.wait(); });
  const monitoring::ProcessUsage during = monitoring::processUsage();
  end.set_value();
  thread.join();
  EXPECT_EQ(during.openDescriptors, before.openDescriptors + 10);
  EXPECT_EQ(during.threads, before.threads + 1);
}

TEST(MetricFamilies, EscapeNamesOfScenes) {
  const std::string name = "a \"scene\" \\ of\nmine";
  const auto scene = std::make_shared<scene::LiveScene>(smallScene(name));
  scene->metrics.tick.record(0.25);
  scene->metrics.ticks.add(3);
  const Exposition read(prometheus::TextSerializer().Serialize(monitoring::sceneFamilies({scene})));
  EXPECT_EQ(read.value("clothstream_scene_ticks_total", {{"scene", name}}), 3);
  EXPECT_EQ(read.value("clothstream_scene_tick_seconds_sum", {{"scene", name}}), 0.25);
  EXPECT_EQ(read.value("clothstream_scene_tick_seconds_bucket", {{"scene", name}, {"le", "0.2154"}}), 0);
  EXPECT_EQ(read.value("clothstream_scene_tick_seconds_bucket", {{"scene", name}, {"le", "0.4642"}}), 1);
}

// Blocks the device thread in a tick on request.
class BlockingJournal final : public scene::Journal {
 public:
  void block(bool blocked) {
    {
      const std::lock_guard lock(mutex_);
      blocked_ = blocked;
    }
    changed_.notify_all();
  }

  bool active() const override { return false; }
  bool due() const override { return false; }
  void begin(const vulkan::DeviceInfo&, const model::Scene&, const v1::StreamDescription&,
             const simulation::StateSnapshot&, const simulation::StateSnapshot&) override {}
  void ticked(const scene::AppliedTick&) override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !blocked_; });
  }
  void saved(const simulation::StateSnapshot&) override {}
  void restored(std::uint64_t, const simulation::StateSnapshot&) override {}
  void end() override {}
  void sent(const delivery::SharedBytes&) override {}
  void joined(std::uint64_t, const std::string&, const std::string&) override {}
  void left(std::uint64_t) override {}

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool blocked_ = false;
};

class StuckDevice : public MonitoringTest {
 protected:
  hosting::ServerOptions options() override {
    hosting::ServerOptions options;
    options.journals = [this](const model::Scene&) { return journal_; };
    return options;
  }
  void TearDown() override {
    journal_->block(false);
    MonitoringTest::TearDown();
  }
  std::chrono::milliseconds silence() const override { return 1s; }

  const std::shared_ptr<BlockingJournal> journal_ = std::make_shared<BlockingJournal>();
};

TEST_F(StuckDevice, IsUnhealthyUntilTheDeviceThreadAnswers) {
  const auto healthy = [&] { return get("/healthz").result() == http::status::ok; };
  ASSERT_TRUE(eventually(healthy)) << "an idle device thread answers";
  std::this_thread::sleep_for(2 * silence());
  ASSERT_TRUE(eventually(healthy)) << "it also answers while no scene runs";
  Joined joined(connect());
  ASSERT_TRUE(eventually(healthy));
  journal_->block(true);
  ASSERT_TRUE(eventually([&] { return !healthy(); }));
  const Response stuck = get("/healthz");
  EXPECT_EQ(stuck.result(), http::status::service_unavailable);
  EXPECT_THAT(stuck.body(), HasSubstr("The device thread has not answered for"));
  EXPECT_EQ(get("/readyz").result(), http::status::ok);
  EXPECT_GT(scrape().value("clothstream_device_silence_seconds"), 1) << "a stuck device can be scraped";
  journal_->block(false);
  EXPECT_TRUE(eventually(healthy));
}

}  // namespace
}  // namespace clothstream::tests
