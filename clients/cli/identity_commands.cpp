// SPDX-License-Identifier: MIT
#include "clients/cli/identity_commands.h"

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/presence.h"
#include "clients/cli/print.h"
#include "clients/grpc/identity.h"

namespace clothstream::cli {
namespace {

ExitCode refused(const Failure& failure) {
  return printError(failure);
}

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
  bans_ = command("bans", "List the bans of a scene");
  unban_ = command("unban", "Lift a ban");
  for (CLI::App* added : {bans_, unban_}) added->add_option("SCENE", scene_, "Name of the scene")->required();
  unban_->add_option("SUBJECT", subject_, "Subject, as `clothstream bans` shows it")->required();
}

bool IdentityCommands::parsed() const {
  return pairingCode_->parsed() || bans_->parsed() || unban_->parsed();
}

ExitCode IdentityCommands::run(const ServerAddress& address) const {
  if (pairingCode_->parsed()) return makeCode(address);
  if (bans_->parsed()) return listBans(address);
  const auto lifted = liftBan(address, scene_, subject_);
  return lifted ? kOk : refused(lifted.error());
}

ExitCode IdentityCommands::makeCode(const ServerAddress& address) const {
  const auto made = createPairingCode(address, roleNamed(role_).value_or(CS_ROLE_PARTICIPANT));
  if (!made) return refused(made.error());
  print("{} makes a client {} of this server; valid for {} s\n", made->code, role_, made->validSeconds);
  return kOk;
}

ExitCode IdentityCommands::listBans(const ServerAddress& address) const {
  const auto bans = clothstream::listBans(address, scene_);
  if (!bans) return refused(bans.error());
  for (const Ban& ban : *bans) print("{}  {}\n", ban.subject, ban.displayName);
  return kOk;
}

}  // namespace clothstream::cli
