// SPDX-License-Identifier: MIT
#include "clients/cli/participant_commands.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/presence.h"
#include "clients/cli/print.h"
#include "clients/cli/recording_limits.h"
#include "clients/grpc/grpc_client.h"

namespace clothstream::cli {
namespace {

constexpr std::chrono::seconds kPatience{10};

// The server's answer to a change of one participant. The stream's thread sets it.
class Answer {
 public:
  // `kind` is the presence event that the change causes.
  Answer(std::uint64_t participant, cs_presence_kind kind) : participant_(participant), kind_(kind) {}

  void heard(cs_client* client, std::uint32_t events) {
    const std::lock_guard lock(mutex_);
    cs_presence presence;
    cs_participant participant;
    if ((events & CS_EVENT_ERROR) != 0) text_ = cs_error_text(client);
    if ((events & CS_EVENT_PRESENCE) != 0 && cs_get_presence(client, &presence, &participant) != 0 &&
        presence.kind == kind_ && participant.id == participant_)
      text_ = "";
    changed_.notify_all();
  }
  // Returns an empty text after the change, else why it failed.
  std::string wait() {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return text_.has_value(); }))
      return fmt::format("the server did not answer within {} s", kPatience.count());
    return *text_;
  }

 private:
  const std::uint64_t participant_;
  const cs_presence_kind kind_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::string> text_;
};

std::optional<cs_participant> find(const cs_client* client, std::uint64_t id) {
  cs_participant participant;
  for (std::uint32_t i = 0; cs_get_participant(client, i, &participant) != 0; ++i)
    if (participant.id == id) return participant;
  return std::nullopt;
}

}  // namespace

void ParticipantCommands::add(CLI::App& app, std::string& address) {
  participants_ = app.add_subcommand("participants", "List the participants of a scene");
  participants_->add_flag("--json", json_, "Print a JSON array");
  setRole_ = app.add_subcommand("role", "Give a participant of a scene another role");
  remove_ = app.add_subcommand("remove", "Remove a participant from a scene; it may join again");
  ban_ = app.add_subcommand("ban", "Remove a participant from a scene, and keep its subject out");
  for (CLI::App* command : {participants_, setRole_, remove_, ban_}) {
    command->add_option("--server", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
        ->capture_default_str();
    command->add_option("SCENE", scene_, "Name of the scene")->required();
    addStreamLimit(*command, maxVertices_);
    if (command != participants_)
      command
          ->add_option("PARTICIPANT", participant_,
                       "Number of the participant, as `clothstream participants` shows it")
          ->required();
  }
  setRole_->add_option("ROLE", role_, "viewer, participant or owner")
      ->check(CLI::IsMember({"viewer", "participant", "owner"}))
      ->required();
}

NativeClientOptions ParticipantCommands::clientOptions(cs_role role) const {
  NativeClientOptions options;
  options.scene = scene_;
  options.clientName = "clothstream participants";
  options.role = role;
  options.maxVertices = maxVertices_;
  options.reconnectFor = std::chrono::milliseconds(0);
  return options;
}

bool ParticipantCommands::parsed() const {
  return participants_->parsed() || setRole_->parsed() || remove_->parsed() || ban_->parsed();
}

ExitCode ParticipantCommands::run(const ServerAddress& address) const {
  return participants_->parsed() ? list(address) : change(address);
}

ExitCode ParticipantCommands::list(const ServerAddress& address) const {
  const auto joined = joinByGrpc(address, clientOptions(CS_ROLE_VIEWER), [](cs_client*, std::uint32_t) {});
  if (!joined) return printError(joined.error());
  auto array = nlohmann::ordered_json::array();
  (*joined)->visit([&](cs_client* client) {
    cs_participant participant;
    for (std::uint32_t i = 0; cs_get_participant(client, i, &participant) != 0; ++i)
      if (participant.id != cs_participant_id(client))
        array.push_back({{"id", participant.id},
                         {"name", participant.name},
                         {"client", participant.client_name},
                         {"role", roleName(participant.role)},
                         {"away", participant.away != 0}});
  });
  if (json_) {
    put(jsonText(array, 2) + '\n');
    return kOk;
  }
  for (const auto& participant : array)
    print("{:>6}  {:<12}  {}{}\n", participant["id"].get<std::uint64_t>(),
          participant["role"].get<std::string>(),
          participant[participant["name"] == "" ? "client" : "name"].get<std::string>(),
          participant["away"].get<bool>() ? ", currently disconnected" : "");
  return kOk;
}

ExitCode ParticipantCommands::change(const ServerAddress& address) const {
  Answer answer(participant_, setRole_->parsed() ? CS_PRESENCE_ROLE_CHANGED : CS_PRESENCE_LEFT);
  const auto joined =
      joinByGrpc(address, clientOptions(CS_ROLE_UNSPECIFIED),
                 [&](cs_client* client, std::uint32_t events) { answer.heard(client, events); });
  if (!joined) return printError(joined.error());
  bool hasRole = false;
  (*joined)->visit([&](cs_client* client) {
    if (!setRole_->parsed()) {
      if (ban_->parsed())
        cs_ban_participant(client, participant_);
      else
        cs_remove_participant(client, participant_);
      return;
    }
    const cs_role role = roleNamed(role_).value_or(CS_ROLE_VIEWER);
    const std::optional<cs_participant> participant = find(client, participant_);
    hasRole = participant && participant->role == role;
    if (!hasRole) cs_set_role(client, participant_, role);
  });
  if (hasRole) return kOk;
  const std::string failure = answer.wait();
  return failure.empty() ? kOk : printError(kRefused, failure);
}

}  // namespace clothstream::cli
