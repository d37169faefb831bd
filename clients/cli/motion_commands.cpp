// SPDX-License-Identifier: MIT
#include "clients/cli/motion_commands.h"

#include <csignal>
#include <map>

#include "proto/codec/stream_layout.h"

namespace clothstream::cli {

void MotionCommands::add(CLI::App& app) {
  encode_ = app.add_subcommand("encode",
                               "Encode a motion of a grid in a file as the stream that a server would send");
  encode_->footer(kExitCodes);
  encode_
      ->add_option(
          "MOTION", encodeOptions_.motion,
          "int32 columns, rows, frames, 0; then of each frame float32 positions and float32 normals (of "
          "which only the side is used), 3 a vertex, row-major; little-endian, metres, 72 frames a second")
      ->required();
  encode_->add_option("OUT", encodeOptions_.out, "The file for the description of the stream and its packets")
      ->required();
  const std::map<std::string, Quality> qualities{
      {"fine", Quality::fine}, {"standard", Quality::standard}, {"coarse", Quality::coarse}};
  CLI::Option* quality =
      encode_
          ->add_option(
              "--quality", encodeOptions_.quality,
              "The max error as a part of the mean edge of the cloth in its first frame: fine 1.25 %, "
              "standard 2.5 % (the default), coarse 5 %")
          ->transform(CLI::Transformer(qualities, CLI::ignore_case).description("fine|standard|coarse"));
  encode_
      ->add_option(
          "--max-error", encodeOptions_.maxError,
          "Metres along each of three axes, instead of a quality: no vertex is farther than sqrt(3) times "
          "that from where it should be")
      ->check(CLI::PositiveNumber)
      ->excludes(quality);
  encode_
      ->add_option("--layers", encodeOptions_.layers,
                   "Temporal layers: with 2 or 3 every second frame, or three of four, can be left out")
      ->check(CLI::Range(1u, std::uint32_t{codec::kMaxTemporalLayers}))
      ->capture_default_str();
  encode_
      ->add_option("--key-every", encodeOptions_.keyEvery,
                   "Frames from key frame to key frame (0: the first alone)")
      ->capture_default_str();
  encode_->add_flag("--json", encodeOptions_.json, "Print the summary as one JSON object");

  decode_ = app.add_subcommand("decode", "Decode what encode wrote");
  decode_->footer(kExitCodes);
  decode_->add_option("OUT", decodeOptions_.recording, "The file that encode wrote")->required();
  decode_
      ->add_option(
          "FRAMES", decodeOptions_.out,
          "The file for the decoded motion, in the form that encode reads: positions, and the normals that "
          "follow from them")
      ->required();
  decode_
      ->add_option("--max-vertices", decodeOptions_.maxVertices,
                   "More than that are refused: what a file says of itself decides how much memory it takes")
      ->check(CLI::Range(1u, codec::kMaxVertices))
      ->capture_default_str();
}

ExitCode MotionCommands::run() const {
  // A file that may grow no more is then an error like a full disk, and what there is of it is cleared away.
  std::signal(SIGXFSZ, SIG_IGN);
  return encode_->parsed() ? encode(encodeOptions_) : decode(decodeOptions_);
}

}  // namespace clothstream::cli
