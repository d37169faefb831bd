// SPDX-License-Identifier: MIT
#include "clients/cli/fleet.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <nats/nats.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clothstream/v1/fleet.pb.h"

namespace clothstream::cli {
namespace {

constexpr std::int64_t kWait = 3000;         // milliseconds
constexpr std::int64_t kMoveWait = 180'000;  // a large scene is loaded first
constexpr std::size_t kMaxEntries = 100'000;
// Subjects for answers to this program, which servers and edges do not subscribe to.
constexpr const char* kInboxes = "clothstream.inbox.operator";
constexpr std::int64_t kLease = 5'000'000'000;  // ns, as in the servers

void require(natsStatus status, const std::string& what) {
  if (status != NATS_OK) throw std::runtime_error(fmt::format("{}: {}", what, natsStatus_GetText(status)));
}

template <typename T, void (*destroy)(T*)>
struct Destroyer {
  void operator()(T* object) const { destroy(object); }
};
template <typename T, void (*destroy)(T*)>
using Owned = std::unique_ptr<T, Destroyer<T, destroy>>;

// Calls a function of the library that returns an object in its first argument.
template <typename Own, typename Make>
Own made(const std::string& what, Make make) {
  typename Own::pointer object = nullptr;
  require(make(&object), what);
  return Own(object);
}

using Connection = Owned<natsConnection, &natsConnection_Destroy>;

Connection connect(const std::vector<std::string>& servers, const std::string& credentials,
                   const std::string& authority) {
  const auto options = made<Owned<natsOptions, &natsOptions_Destroy>>("NATS", &natsOptions_Create);
  std::vector<const char*> urls;
  for (const std::string& server : servers) urls.push_back(server.c_str());
  require(natsOptions_SetServers(options.get(), urls.data(), static_cast<int>(urls.size())), "--nats");
  require(natsOptions_SetTimeout(options.get(), kWait), "NATS");
  require(natsOptions_SetCustomInboxPrefix(options.get(), kInboxes), "NATS");
  require(natsOptions_SetAllowReconnect(options.get(), false), "NATS");
  if (!credentials.empty())
    require(natsOptions_SetUserCredentialsFromFiles(options.get(), credentials.c_str(), nullptr),
            "--nats-credentials " + credentials);
  if (!authority.empty()) {
    require(natsOptions_LoadCATrustedCertificates(options.get(), authority.c_str()),
            "--nats-ca " + authority);
    require(natsOptions_SetSecure(options.get(), true), "--nats-ca");
  }
  return made<Connection>(
      fmt::format("NATS at {}", fmt::join(servers, ", ")),
      [&](natsConnection** connection) { return natsConnection_Connect(connection, options.get()); });
}

struct Directory {
  std::map<std::string, v1::SceneEntry> scenes;  // by name
  std::map<std::uint64_t, v1::ServerEntry> servers;
  std::map<std::uint64_t, std::int64_t> renewed;  // by the clock of NATS, ns

  // Whether the server has renewed its entry at most five seconds before the newest one of all.
  bool isAlive(std::uint64_t origin) const {
    std::int64_t newest = 0;
    for (const auto& [other, time] : renewed) newest = std::max(newest, time);
    const auto found = renewed.find(origin);
    return found != renewed.end() && newest - found->second < kLease;
  }

  // Servers that match an id or a public name.
  std::vector<std::uint64_t> matching(const std::string& text) const {
    std::uint64_t id = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), id, 16);
    const bool isNumber = problem == std::errc() && end == text.data() + text.size();
    std::vector<std::uint64_t> found;
    for (const auto& [origin, server] : servers)
      if ((isNumber && origin == id) || server.public_name() == text) found.push_back(origin);
    return found;
  }
};

template <typename Message>
void readBucket(jsCtx* context, const char* bucket, const auto& take) {
  kvStore* opened = nullptr;
  const natsStatus status = js_KeyValue(&opened, context, bucket);
  if (status == NATS_NOT_FOUND) return;  // no server has used it yet
  if (status != NATS_OK)
    throw std::runtime_error(fmt::format("the directory of the fleet, {}: {} (nats-server needs --jetstream)",
                                         bucket, natsStatus_GetText(status)));
  const Owned<kvStore, &kvStore_Destroy> store(opened);
  const auto watcher = made<Owned<kvWatcher, &kvWatcher_Destroy>>(
      bucket, [&](kvWatcher** watching) { return kvStore_WatchAll(watching, store.get(), nullptr); });
  for (std::size_t count = 0; count < kMaxEntries; ++count) {
    kvEntry* next = nullptr;
    require(kvWatcher_Next(&next, watcher.get(), kWait), bucket);
    if (next == nullptr) return;  // these were all
    const Owned<kvEntry, &kvEntry_Destroy> entry(next);
    Message message;
    if (kvEntry_Operation(next) == kvOp_Put &&
        message.ParseFromArray(kvEntry_Value(next), kvEntry_ValueLen(next)))
      take(kvEntry_Key(next), message, kvEntry_Created(next));
  }
}

Directory read(natsConnection* connection) {
  jsOptions options;
  jsOptions_Init(&options);
  options.Wait = kWait;
  const auto context = made<Owned<jsCtx, &jsCtx_Destroy>>(
      "NATS", [&](jsCtx** made) { return natsConnection_JetStream(made, connection, &options); });
  Directory directory;
  readBucket<v1::ServerEntry>(context.get(), "clothstream-servers",
                              [&](const char*, const v1::ServerEntry& server, std::int64_t time) {
                                directory.servers.emplace(server.origin(), server);
                                directory.renewed.emplace(server.origin(), time);
                              });
  readBucket<v1::SceneEntry>(context.get(), "clothstream-scenes",
                             [&](const char* name, const v1::SceneEntry& scene, std::int64_t) {
                               directory.scenes.emplace(name, scene);
                             });
  return directory;
}

std::string idOf(std::uint64_t origin) {
  return fmt::format("{:016x}", origin);
}

std::string json(const Directory& directory) {
  auto servers = nlohmann::ordered_json::array(), scenes = nlohmann::ordered_json::array();
  for (const auto& [origin, server] : directory.servers)
    servers.push_back({{"server", idOf(origin)},
                       {"name", server.server_name()},
                       {"publicName", server.public_name()},
                       {"participants", server.participants()},
                       {"createdScenes", server.created_scenes()},
                       {"maxCreatedScenes", server.max_created_scenes()},
                       {"load", server.load()},
                       {"maxLoad", server.max_load()},
                       {"stopping", server.stopping()},
                       {"gone", !directory.isAlive(origin)}});
  for (const auto& [name, scene] : directory.scenes)
    scenes.push_back({{"scene", name},
                      {"server", idOf(scene.origin())},
                      {"created", scene.created()},
                      {"checkpointTick", scene.checkpoint().tick()}});
  return jsonText(nlohmann::ordered_json{{"servers", servers}, {"scenes", scenes}}, 2);
}

void printTables(const Directory& directory) {
  print("{:<17} {:<24} {:<24} {:>12} {:>10} {:>12}\n", "SERVER", "VERSION", "NAME", "PARTICIPANTS", "CREATED",
        "LOAD");
  for (const auto& [origin, server] : directory.servers)
    print("{:<17} {:<24} {:<24} {:>12} {:>10} {:>12}{}\n", idOf(origin), server.server_name(),
          server.public_name().empty() ? "-" : server.public_name(), server.participants(),
          fmt::format("{} of {}", server.created_scenes(), server.max_created_scenes()),
          fmt::format("{:.2f} of {:.0f}", server.load(), server.max_load()),
          !directory.isAlive(origin) ? "  gone"
          : server.stopping()        ? "  stopping"
                                     : "");
  print("\n{:<32} {:<17} {}\n", "SCENE", "SERVER", "CREATED");
  for (const auto& [name, scene] : directory.scenes)
    print("{:<32} {:<17} {}{}\n", name, idOf(scene.origin()), scene.created() ? "yes" : "no",
          directory.isAlive(scene.origin()) ? "" : "  (its server is gone)");
}

}  // namespace

void FleetCommands::add(CLI::App& app, CLI::App& list) {
  list_ = &list;
  move_ = app.add_subcommand("move", "Move a scene that a client created to another server of a fleet");
  move_->add_option("SCENE", scene_, "Name of the scene")->required();
  move_
      ->add_option("--to", to_,
                   "Server that shall have it: its number or name in \"clothstream list --nats\". "
                   "Default: the one with the most room")
      ->type_name("SERVER");
  for (CLI::App* command : {list_, move_}) {
    CLI::Option* const nats =
        command
            ->add_option("--nats", servers_,
                         command == list_
                             ? "List the servers and scenes of a fleet: URL of its NATS server, such as "
                               "nats://10.0.0.5:4222; may be repeated"
                             : "URL of a NATS server of the fleet; may be repeated")
            ->type_name("URL")
            ->delimiter(',');
    if (command == move_) nats->required();
    command->add_option("--nats-credentials", credentials_, "File with the credentials of a NATS user")
        ->type_name("FILE")
        ->needs(nats);
    command
        ->add_option("--nats-ca", authority_,
                     "Require TLS, with a certificate of an authority in this PEM file")
        ->type_name("FILE")
        ->needs(nats);
  }
}

ExitCode FleetCommands::run(bool json) const {
  try {
    return move_->parsed() ? move() : list(json);
  } catch (const std::exception& failure) {
    return printError(kUnreachable, failure.what());
  }
}

ExitCode FleetCommands::list(bool asJson) const {
  const Connection connection = connect(servers_, credentials_, authority_);
  const Directory directory = read(connection.get());
  if (asJson)
    put(json(directory) + '\n');
  else
    printTables(directory);
  return kOk;
}

ExitCode FleetCommands::move() const {
  const Connection connection = connect(servers_, credentials_, authority_);
  const Directory directory = read(connection.get());
  const auto scene = directory.scenes.find(scene_);
  if (scene == directory.scenes.end())
    return printError(kRefused,
                      fmt::format("the directory has no scene '{}'; see clothstream list --nats", scene_));
  v1::MoveRequest request;
  request.set_scene(scene_);
  if (!to_.empty()) {
    const std::vector<std::uint64_t> matching = directory.matching(to_);
    if (matching.size() != 1)
      return printError(kRefused, fmt::format("--to {}: {} servers have this number or name; see clothstream "
                                              "list --nats",
                                              to_, matching.size()));
    request.set_to(matching.front());
  }
  const std::string bytes = request.SerializeAsString();
  const std::string subject = fmt::format("clothstream.servers.{}", idOf(scene->second.origin()));
  natsMsg* answered = nullptr;
  const natsStatus status = natsConnection_Request(&answered, connection.get(), subject.c_str(), bytes.data(),
                                                   static_cast<int>(bytes.size()), kMoveWait);
  if (status == NATS_NO_RESPONDERS)
    return printError(kUnreachable, fmt::format("the server that has '{}' does not answer", scene_));
  require(status, "NATS");
  const Owned<natsMsg, &natsMsg_Destroy> answer(answered);
  v1::MoveResponse response;
  if (!response.ParseFromArray(natsMsg_GetData(answered), natsMsg_GetDataLength(answered)))
    return printError(kLost, "the answer is not one");
  if (!response.error().empty()) return printError(kRefused, fmt::format("{}: {}", scene_, response.error()));
  print("{} is at server {} now; it stood still for {:.0f} ms\n", scene_, idOf(response.to()),
        response.gap() * 1000);
  return kOk;
}

}  // namespace clothstream::cli
