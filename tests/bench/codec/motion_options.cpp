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
  app.add_option("--frames", settings.frames, "Frames of a motion, at most")
      ->check(CLI::Range(1u, 1u << 30))
      ->capture_default_str();
  app.add_option("--max-error", settings.maxError, "Of the codecs, m along each of three axes")
      ->check(CLI::Range(double{codec::kSmallestMaxError}, double{codec::kLargestMaxError}))
      ->capture_default_str();
  app.add_option("--encoder-threads", settings.encoderThreads, "Measure codec 2 with so many threads, too")
      ->check(CLI::Range(1u, 64u))
      ->capture_default_str();
}

}  // namespace clothstream::bench
