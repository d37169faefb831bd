// SPDX-License-Identifier: MIT
#include "tests/bench/codec/motion_options.h"

#include "tests/bench/codec/bench_motion.h"

namespace clothstream::bench {

void addMotionOptions(CLI::App& app, Settings& settings) {
  CLI::Option* motions =
      app.add_option("--motion", settings.motions,
                     "What codecs are measured on; may be repeated (the first four, where none "
                     "is named)")
          ->check(CLI::IsMember(motionNames()))
          ->allow_extra_args(false);
  app.add_option_function<std::string>(
         "--input", [&settings](const std::string& path) { settings.input = path; },
         "Instead: a motion in a file, as clothstream encode reads it")
      ->excludes(motions);
  app.add_option("--frames", settings.frames, "Maximum frames of a motion")
      ->check(CLI::Range(1u, 1u << 30))
      ->capture_default_str();
  app.add_option("--max-error", settings.maxError,
                 "Max error of the codecs in metres along each of three axes")
      ->check(CLI::Range(double{codec::kSmallestMaxError}, double{codec::kLargestMaxError}))
      ->capture_default_str();
  app.add_option("--encoder-threads", settings.encoderThreads, "Also measure codec 2 with this many threads")
      ->check(CLI::Range(1u, 64u))
      ->capture_default_str();
}

}  // namespace clothstream::bench
