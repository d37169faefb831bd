// SPDX-License-Identifier: MIT
#include "clients/cli/recording_commands.h"

#include <csignal>

namespace clothstream::cli {

void RecordingCommands::add(CLI::App& app, std::string& address) {
  record_ = app.add_subcommand("record", "Join a scene and write its stream to a file (MCAP)");
  record_->footer(kExitCodes);
  record_->add_option("SCENE", recordOptions_.scene, "The scene; the server's default if left out");
  record_->add_option("-o,--output", recordOptions_.output, "The file, which must not be there yet")
      ->type_name("FILE")
      ->required();
  record_
      ->add_option("--seconds", recordOptions_.seconds, "For so long; otherwise until an interrupt (Ctrl-C)")
      ->check(CLI::PositiveNumber);
  record_->add_option("--server", address, "HOST or HOST:PORT of the server")->capture_default_str();

  info_ = app.add_subcommand("info", "Say what is in a recording, and check all of it");
  info_->footer(kExitCodes);
  info_->add_option("FILE", infoOptions_.recording, "The recording")->required();
  info_->add_flag("--quick", infoOptions_.quick, "Go by its index alone, and check nothing else");
  info_->add_flag("--json", infoOptions_.json, "Print one JSON object");

  recover_ = app.add_subcommand("recover", "Make a whole recording of what a damaged or cut one still holds");
  recover_->footer(kExitCodes);
  recover_->add_option("FILE", recoverOptions_.recording, "The damaged recording, which stays as it is")
      ->required();
  recover_->add_option("OUT", recoverOptions_.out, "The whole one, which must not be there yet")->required();

  export_ = app.add_subcommand("export", "Write a recording's frames as an animated glTF, or as OBJ files");
  export_->footer(kExitCodes);
  export_->add_option("FILE", exportOptions_.recording, "The recording")->required();
  export_
      ->add_option("OUT", exportOptions_.out,
                   "OUT.glb, or OUT.gltf as text, for a glTF with a morph target a frame, or else a "
                   "directory for an OBJ file a "
                   "frame; there must be none yet")
      ->required();
  export_->add_option("--rate", exportOptions_.rate, "Frames a second, at most")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  export_->add_option("--from", exportOptions_.from, "Seconds of the recording to leave out")
      ->check(CLI::NonNegativeNumber);
  export_->add_option("--seconds", exportOptions_.seconds, "So many of the recording, at most")
      ->check(CLI::PositiveNumber);
}

bool RecordingCommands::parsed() const {
  return record_->parsed() || info_->parsed() || recover_->parsed() || export_->parsed();
}

ExitCode RecordingCommands::run(const std::string& address, const std::string& program) {
  // A file that may grow no more is then an error like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  if (info_->parsed()) return info(infoOptions_);
  if (recover_->parsed()) return recover(recoverOptions_);
  if (export_->parsed()) return exportFrames(exportOptions_);
  recordOptions_.address = address;
  recordOptions_.program = program;
  return record(recordOptions_);
}

}  // namespace clothstream::cli
