// SPDX-License-Identifier: MIT
#include "clients/cli/motion_commands.h"

#include <csignal>
#include <map>

#include "proto/codec/stream_layout.h"

namespace clothstream::cli {

void MotionCommands::add(CLI::App& app) {
  encode_ =
      app.add_subcommand("encode", "Encode the motion of a grid in a file, as a server would stream it");
  encode_
      ->add_option("MOTION", encodeOptions_.motion,
                   "Motion file: int32 columns, rows, frames, 0; then per frame float32 positions and "
                   "float32 normals (only "
                   "their side is used), 3 a vertex, row-major; little-endian, metres, 72 frames a second")
      ->required();
  encode_->add_option("OUT", encodeOptions_.out, "File to write: description of the stream and its packets")
      ->required();
  const std::map<std::string, Quality> qualities{
      {"fine", Quality::fine}, {"standard", Quality::standard}, {"coarse", Quality::coarse}};
  CLI::Option* quality =
      encode_
          ->add_option("--quality", encodeOptions_.quality,
                       "Max error as a fraction of the mean edge length in the first frame: fine 1.25 %, "
                       "standard 2.5 % (default), coarse 5 %")
          ->transform(CLI::Transformer(qualities, CLI::ignore_case).description("fine|standard|coarse"));
  encode_
      ->add_option("--max-error", encodeOptions_.maxError,
                   "Max error in metres along each axis, instead of a quality; the error of a vertex is at "
                   "most sqrt(3) "
                   "times that")
      ->check(CLI::PositiveNumber)
      ->excludes(quality);
  encode_
      ->add_option("--key-every", encodeOptions_.keyEvery,
                   "Frames from one key frame to the next; 0: only the first frame")
      ->capture_default_str();
  encode_->add_flag("--json", encodeOptions_.json, "Print the summary as one JSON object");

  decode_ = app.add_subcommand("decode", "Decode a file that encode wrote");
  decode_->add_option("OUT", decodeOptions_.recording, "File that encode wrote")->required();
  decode_
      ->add_option("FRAMES", decodeOptions_.out,
                   "Motion file to write, in the format that encode reads: decoded positions, and normals "
                   "computed from them")
      ->required();
  decode_
      ->add_option("--max-vertices", decodeOptions_.maxVertices,
                   "Refuse files with more vertices, since the file decides how much memory is needed")
      ->check(CLI::Range(1u, codec::kMaxVertices))
      ->capture_default_str();
}

ExitCode MotionCommands::run() const {
  // Makes a file size limit an error like a full disk, so that the incomplete file is removed.
  std::signal(SIGXFSZ, SIG_IGN);
  return encode_->parsed() ? encode(encodeOptions_) : decode(decodeOptions_);
}

}  // namespace clothstream::cli
