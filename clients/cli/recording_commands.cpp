// SPDX-License-Identifier: MIT
#include "clients/cli/recording_commands.h"

#include <csignal>

#include "clients/cli/recording_limits.h"

namespace clothstream::cli {

void RecordingCommands::add(CLI::App& app, std::string& address) {
  record_ = app.add_subcommand("record", "Join a scene and write its stream to a file (MCAP)");
  record_->add_option("SCENE", recordOptions_.scene, "Scene; default: the server's default scene");
  record_->add_option("-o,--output", recordOptions_.output, "File to write; must not exist")
      ->type_name("FILE")
      ->required();
  record_
      ->add_option("--seconds", recordOptions_.seconds,
                   "Stop this long after the first frame; default: at an interrupt (Ctrl-C)")
      ->check(CLI::PositiveNumber);
  addStreamLimit(*record_, recordOptions_.maxVertices);
  record_->add_flag(
      "--full-quality", recordOptions_.fullQuality,
      "End the recording with an error before the first frame that the server sends in a coarser "
      "quality, because the connection or this machine is too slow for the finest one");
  record_->add_option("--server", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
      ->capture_default_str();

  info_ = app.add_subcommand("info", "Show the content of a recording and check all of it");
  info_->add_option("FILE", infoOptions_.recording, "The recording")->required();
  info_->add_flag("--quick", infoOptions_.quick, "Read only the index and check nothing else");
  info_->add_flag("--json", infoOptions_.json, "Print one JSON object");
  addLimits(*info_, infoOptions_.limits);

  recover_ =
      app.add_subcommand("recover", "Write a complete recording from the readable parts of a damaged one");
  recover_->add_option("FILE", recoverOptions_.recording, "Damaged recording; it is not changed")->required();
  recover_->add_option("OUT", recoverOptions_.out, "Recording to write; must not exist")->required();
  addLimits(*recover_, recoverOptions_.limits);

  export_ = app.add_subcommand(
      "export", "Write the frames of a recording as an animated glTF, as OBJ files, or for numpy");
  export_->add_option("FILE", exportOptions_.recording, "The recording")->required();
  export_
      ->add_option(
          "OUT", exportOptions_.out,
          "NAME.glb (binary) or NAME.gltf (text) for a glTF with one morph target per frame; NAME.npz for "
          "arrays of numpy; any other name for a directory with one OBJ file per frame. Must not exist")
      ->required();
  export_
      ->add_option("--rate", exportOptions_.rate,
                   "Most frames a second. Default: 24, but all frames for NAME.npz")
      ->check(CLI::PositiveNumber);
  export_->add_option("--from", exportOptions_.from, "Seconds of the recording to skip")
      ->check(CLI::NonNegativeNumber);
  export_->add_option("--seconds", exportOptions_.seconds, "Most seconds of the recording to export")
      ->check(CLI::PositiveNumber);
  addLimits(*export_, exportOptions_.limits);
}

bool RecordingCommands::parsed() const {
  return record_->parsed() || info_->parsed() || recover_->parsed() || export_->parsed();
}

ExitCode RecordingCommands::run(const ServerAddress& address, const std::string& program) {
  // Makes a file size limit an error like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  if (info_->parsed()) return info(infoOptions_);
  if (recover_->parsed()) return recover(recoverOptions_);
  if (export_->parsed()) return exportFrames(exportOptions_);
  recordOptions_.address = address;
  recordOptions_.program = program;
  return record(recordOptions_);
}

}  // namespace clothstream::cli
