// SPDX-License-Identifier: MIT
#include "clients/cli/identity_commands.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/presence.h"
#include "clients/grpc/grpc_client.h"
#include "clients/grpc/identity.h"
#include "proto/text/printable.h"

namespace clothstream::cli {
namespace {

constexpr std::chrono::seconds kPatience{10};

ExitCode refused(const Failure& failure) {
  return printError(failure);
}

// The server's answer to a ban. The stream's thread sets it.
class Answer {
 public:
  explicit Answer(std::uint64_t participant) : participant_(participant) {}

  void heard(cs_client* client, std::uint32_t events) {
    const std::lock_guard lock(mutex_);
    cs_presence presence;
    if ((events & CS_EVENT_ERROR) != 0) text_ = cs_error_text(client);
    if ((events & CS_EVENT_PRESENCE) != 0 && cs_get_presence(client, &presence) != 0 &&
        presence.kind == CS_PRESENCE_LEFT && presence.participant.id == participant_)
      text_ = "";
    changed_.notify_all();
  }
  // Returns an empty text after the ban, else why it failed.
  std::string wait() {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return text_.has_value(); }))
      return fmt::format("the server did not answer within {} s", kPatience.count());
    return *text_;
  }

 private:
  const std::uint64_t participant_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::string> text_;
};

}  // namespace

void IdentityCommands::add(CLI::App& app, std::string& address) {
  const auto command = [&](const char* name, const char* what) {
    CLI::App* const added = app.add_subcommand(name, what);
    added->add_option("--server", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
        ->capture_default_str();
    return added;
  };
  pairingCode_ = command("pairing-code", "Print a code by which others pair with the server");
  pairingCode_->add_option("--role", role_, "Role of those who use the code")
      ->check(CLI::IsMember({"viewer", "participant", "owner"}))
      ->capture_default_str();
  ban_ = command("ban", "Remove a participant from a scene, and keep its subject out");
  bans_ = command("bans", "List the bans of a scene");
  unban_ = command("unban", "Lift a ban");
  for (CLI::App* added : {ban_, bans_, unban_})
    added->add_option("SCENE", scene_, "Name of the scene")->required();
  ban_->add_option("PARTICIPANT", participant_, "Number of the participant, as `clothstream join` shows it")
      ->required();
  unban_->add_option("SUBJECT", subject_, "Subject, as `clothstream bans` shows it")->required();
}

bool IdentityCommands::parsed() const {
  return pairingCode_->parsed() || ban_->parsed() || bans_->parsed() || unban_->parsed();
}

ExitCode IdentityCommands::run(const ServerAddress& address) const {
  if (pairingCode_->parsed()) return makeCode(address);
  if (ban_->parsed()) return ban(address);
  if (bans_->parsed()) return listBans(address);
  const auto lifted = liftBan(address, scene_, subject_);
  return lifted ? kOk : refused(lifted.error());
}

ExitCode IdentityCommands::makeCode(const ServerAddress& address) const {
  const auto made = createPairingCode(address, roleNamed(role_).value_or(CS_ROLE_PARTICIPANT));
  if (!made) return refused(made.error());
  fmt::print("{} makes a client {} of this server; valid for {} s\n", printable(made->code), role_,
             made->validSeconds);
  return kOk;
}

ExitCode IdentityCommands::ban(const ServerAddress& address) const {
  Answer answer(participant_);
  NativeClientOptions options;
  options.scene = scene_;
  options.clientName = "clothstream ban";
  options.reconnectFor = std::chrono::milliseconds(0);
  const auto joined = joinByGrpc(
      address, options, [&](cs_client* client, std::uint32_t events) { answer.heard(client, events); });
  if (!joined) return refused(joined.error());
  (*joined)->visit([&](cs_client* client) { cs_ban_participant(client, participant_); });
  const std::string failure = answer.wait();
  return failure.empty() ? kOk : printError(kRefused, failure);
}

ExitCode IdentityCommands::listBans(const ServerAddress& address) const {
  const auto bans = clothstream::listBans(address, scene_);
  if (!bans) return refused(bans.error());
  for (const Ban& ban : *bans) fmt::print("{}  {}\n", printable(ban.subject), printable(ban.displayName));
  return kOk;
}

}  // namespace clothstream::cli
