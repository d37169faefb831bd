// SPDX-License-Identifier: MIT
#include "clients/xr/program_options.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace clothstream::xr {
namespace {

// Token in a file, without the space around it.
std::string readToken(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw CLI::ValidationError("--token", fmt::format("{} cannot be read", file));
  std::string token;
  in >> std::setw(CLOTHSTREAM_TOKEN_BYTES) >> token;
  if (token.empty()) throw CLI::ValidationError("--token", fmt::format("{} has no token", file));
  if (token.size() >= CLOTHSTREAM_TOKEN_BYTES)
    throw CLI::ValidationError("--token",
                               fmt::format("{} has more than {} bytes", file, CLOTHSTREAM_TOKEN_BYTES - 1));
  return token;
}

std::string sixDigits(std::string& code) {
  std::erase(code, ' ');
  const bool isCode =
      code.size() == 6 && std::ranges::all_of(code, [](unsigned char c) { return std::isdigit(c); });
  return isCode ? ""
                : fmt::format("\"{}\" is no pairing code; use the six digits that the server shows", code);
}

// A number within bounds. CLI::Range accepts what is not a number.
CLI::Validator within(double least, double most) {
  const auto check = [least, most](std::string& text) -> std::string {
    double number = 0;
    const bool isWithin = CLI::detail::lexical_cast(text, number) && number >= least && number <= most;
    return isWithin ? "" : fmt::format("\"{}\" is not a number from {} to {}", text, least, most);
  };
  return {check, fmt::format("[{} - {}]", least, most)};
}

// A name, which stands for a value.
template <typename Value>
CLI::Validator oneOf(const std::vector<std::pair<std::string, Value>>& choices) {
  std::string names;
  for (const auto& [name, value] : choices) names += (names.empty() ? "" : ", ") + name;
  const auto replace = [choices, names](std::string& text) -> std::string {
    for (const auto& [name, value] : choices) {
      if (text != name) continue;
      text = std::to_string(static_cast<std::uint32_t>(value));
      return "";
    }
    return fmt::format("\"{}\" is not allowed; use one of: {}", text, names);
  };
  return {replace, fmt::format("{{{}}}", names)};
}

void addConnection(CLI::App& app, ProgramOptions& options, std::string& tokenFile) {
  ConnectionOptions& connection = options.connection;
  app.add_option(
      "ADDRESS", connection.address,
      "HOST or HOST:PORT of the server's page; https:// before it means TLS. Default: 127.0.0.1:8080");
  app.add_option("--scene", connection.scene, "Scene to join. Default: the server's default scene");
  app.add_option("--name", connection.name, "Name that other participants see");
  CLI::Option* const code =
      app.add_option("--code", connection.code, "Pairing code: six digits that the server shows")
          ->transform(CLI::Validator(sixDigits, "CODE"));
  app.add_option("--token", tokenFile, "File with a token for a server that requires one")
      ->check(CLI::ExistingFile)
      ->excludes(code);
  CLI::Option* const ca = app.add_option("--ca", connection.caFile,
                                         "PEM file of the authorities that may have signed the certificate "
                                         "of an https:// server. Default: "
                                         "those of the system")
                              ->check(CLI::ExistingFile);
  app.add_option("--fingerprint", connection.fingerprint,
                 "Fingerprint of the key of an https:// server with --tls self, as the server prints it")
      ->excludes(ca);
  app.add_option("--quality", connection.quality, "Best quality of the stream, 0 (finest) to 3. Default: 0")
      ->check(CLI::Range(0, 3));
  app.add_option("--role", connection.role,
                 "Role to request: viewer, participant or owner. Default: the server chooses")
      ->transform(oneOf<std::uint32_t>(
          {{"viewer", CS_ROLE_VIEWER}, {"participant", CS_ROLE_PARTICIPANT}, {"owner", CS_ROLE_OWNER}}));
  app.add_option(
         "--transport", connection.transport,
         "Way of frames and input: datagrams, tcp, or auto (datagrams where they arrive). Default: auto")
      ->transform(oneOf<std::uint32_t>({{"auto", CLOTHSTREAM_TRANSPORT_AUTO},
                                        {"datagrams", CLOTHSTREAM_TRANSPORT_DATAGRAMS},
                                        {"tcp", CLOTHSTREAM_TRANSPORT_TCP}}));
}

void addHeadset(CLI::App& app, ProgramOptions& options) {
  HeadsetOptions& headset = options.headset;
  app.add_flag("--pass-through", headset.passThrough,
               "Show the real room behind the scene, where the headset can");
  app.add_option(
         "--rate", headset.refreshRate,
         "Refresh rate of the headset in Hz, the nearest that it offers. Default: one that suits the stream")
      ->check(within(1, 1000));
  app.add_option("--foveation", headset.foveation,
                 "Fewer samples at the edges of the view, where the headset can: off, low, medium or high. "
                 "Default: low")
      ->transform(oneOf<FoveationLevel>({{"off", FoveationLevel::kOff},
                                         {"low", FoveationLevel::kLow},
                                         {"medium", FoveationLevel::kMedium},
                                         {"high", FoveationLevel::kHigh}}));
  app.add_option("--scale", headset.scale,
                 "Edges of the eyes' pictures, relative to what the runtime recommends. 0.1 to 2. Default: 1")
      ->check(within(0.1, 2));
  app.add_option(
         "--wait", options.waitForRuntime,
         "Seconds to wait for an OpenXR runtime with a headset, at the start and when it is lost. Default: "
         "without limit")
      ->check(within(0, 1e6));
  app.add_option("--eye-pictures", headset.eyePictures,
                 "Folder to which pictures of both eyes are written as PNG")
      ->check(CLI::ExistingDirectory);
  app.add_option("--picture-every", headset.pictureEvery,
                 "Displayed frames from one eye picture to the next. Default: 90")
      ->check(CLI::Range(1, 1'000'000));
}

void addFlat(CLI::App& app, ProgramOptions& options, CLI::Option* flat) {
  FlatOptions& out = options.flat;
  app.add_option("--pictures", out.pictures,
                 "Folder to which --flat writes PNG pictures instead of opening a window")
      ->needs(flat);
  app.add_option(
         "--frames", out.frames,
         "Frames that --flat draws before it ends. Default: until the window is closed, or one picture")
      ->needs(flat)
      ->check(CLI::Range(0, 100'000'000));
  app.add_option("--every", out.every, "With --pictures, write each n-th frame. Default: 1")
      ->needs(flat)
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--width", out.width, "Width of the window or picture, 16 to 8192 pixels. Default: 1280")
      ->needs(flat)
      ->check(CLI::Range(16, 8192));
  app.add_option("--height", out.height, "Height of the window or picture, 16 to 8192 pixels. Default: 800")
      ->needs(flat)
      ->check(CLI::Range(16, 8192));
  app.add_flag("!--no-panel", out.showsPanel, "Leave the panel out of the flat picture")->needs(flat);
}

}  // namespace

std::optional<ProgramOptions> readOptions(int count, char** arguments, int& exitCode) {
  ProgramOptions options;
  options.connection.address = "127.0.0.1:8080";
  std::string tokenFile;
  CLI::App app(
      "Shows a scene of clothstream-server in an OpenXR headset, and lets hands and controllers touch the "
      "cloth.");
  app.set_version_flag("--version", CLOTHSTREAM_VERSION);
  addConnection(app, options, tokenFile);
  CLI::Option* const flat = app.add_flag(
      "--flat", options.isFlat, "Without a headset: in a window, or as pictures where there is no display");
  std::uint32_t samples = 4;
  app.add_option("--samples", samples,
                 "Samples of each pixel against stairs at edges: 1, 2, 4 or 8. Default: 4")
      ->check(CLI::IsMember({1, 2, 4, 8}));
  ShadowDetail shadows = ShadowDetail::kFull;
  app.add_option("--detail", shadows,
                 "full, or reduced: shadows of few samples, for weak graphics devices. Default: full")
      ->transform(oneOf<ShadowDetail>({{"full", ShadowDetail::kFull}, {"reduced", ShadowDetail::kReduced}}));
  addHeadset(app, options);
  addFlat(app, options, flat);
  app.add_option("--font", options.font, "Font file for texts. Default: the sans-serif font of the system")
      ->check(CLI::ExistingFile);
  app.add_flag("--verbose", options.isVerbose,
               "Log the cost of frames every second, and messages of the runtime");
  try {
    app.parse(count, arguments);
    if (!tokenFile.empty()) options.connection.token = readToken(tokenFile);
  } catch (const CLI::ParseError& error) {
    exitCode = app.exit(error) == 0 ? 0 : 2;
    return std::nullopt;
  }
  options.headset.samples = options.flat.samples = samples;
  options.headset.shadows = options.flat.shadows = shadows;
  return options;
}

}  // namespace clothstream::xr
