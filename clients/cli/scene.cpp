// SPDX-License-Identifier: MIT
// Options and actions of the scene commands.
#include "clients/cli/scene.h"

#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include "clients/cli/error.h"
#include "clients/cli/print.h"
#include "clients/grpc/scene_control.h"
#include "proto/text/lines.h"

namespace clothstream::cli {
namespace {

tl::expected<v1::Scene, std::string> readScene(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string json{std::istreambuf_iterator<char>(file), {}};
  if (!file) return tl::unexpected(fmt::format("cannot read {}", path));
  if (isWideText(json))
    return tl::unexpected(
        fmt::format("{}: is text in UTF-16 or UTF-32, which is not supported: save it as UTF-8", path));
  v1::Scene scene;
  const std::string_view text = withoutByteOrderMark(json);
  const auto status = google::protobuf::util::JsonStringToMessage({text.data(), text.size()}, &scene);
  if (!status.ok()) {
    std::string what(status.message());
    if (what.ends_with('.')) what.pop_back();
    return tl::unexpected(fmt::format("{}: not a scene: {}; correct or remove it", path, what));
  }
  const auto refuse = [&](std::string_view what, const std::string& name, const std::string& mesh) {
    return tl::unexpected(
        fmt::format("{}: the {} '{}' refers to the mesh file {}, which the server does not have; "
                    "`clothstream-server print-scene {}` prints the scene with its geometry",
                    path, what, name, mesh, path));
  };
  for (const v1::Cloth& cloth : scene.cloths())
    if (!cloth.mesh().file().empty()) return refuse("cloth", cloth.name(), cloth.mesh().file());
  for (const v1::Collider& collider : scene.colliders())
    if (!collider.mesh().file().empty()) return refuse("collider", collider.name(), collider.mesh().file());
  return scene;
}

ExitCode done(const tl::expected<void, Failure>& result) {
  return result ? kOk : printError(result.error());
}

}  // namespace

void SceneCommands::add(CLI::App& app, std::string& address) {
  const auto command = [&](const char* name, const char* what) { return app.add_subcommand(name, what); };
  const auto takesAddress = [&](CLI::App* added) {
    added->add_option("--server", address, "HOST or HOST:PORT of the server; https:// before it means TLS")
        ->capture_default_str();
  };
  print_ = command("print-scene", "Print a scene of a server as JSON, with its current parameters");
  create_ =
      command("create", "Create a scene on a server from a JSON file, or as a copy of a scene of the server");
  CLI::Option* file = create_->add_option("FILE", options_.file, "Scene in JSON");
  create_->add_option("--named", options_.named, "Copy this scene of the server instead of a file")
      ->excludes(file);
  create_->add_option("--name", options_.name, "Name of the new scene; default: the name in the file");
  create_->add_option("--max-participants", options_.maxParticipants,
                      "Most participants at a time; default: the server's limit");
  create_
      ->add_flag(
          "--repair", options_.repair,
          "Repair the meshes of the file instead of refusing them: divide polygons, drop faces without an "
          "area and duplicates, split edges, turn faces")
      ->excludes("--named");
  create_
      ->add_flag("--fit", options_.fit,
                 "Scale meshes of the file that are not within the world to 2 m, and move them to their pose")
      ->excludes("--named");
  takesAddress(create_);
  delete_ = command("delete", "Delete a scene that was created; its participants are notified");
  pause_ = command("pause", "Pause a scene");
  resume_ = command("resume", "Resume a paused scene");
  reset_ = command("reset", "Reset the cloths of a scene to their start");
  seek_ = command("seek", "Continue a played recording at another time");
  speed_ = command("speed", "Set the speed of a played recording");
  loop_ = command("loop", "Set whether a played recording restarts at its end");
  startRecording_ = command("start-recording", "Record a scene to a file on the server");
  startRecording_->add_option("--name", options_.recording,
                              "Name of the file without .mcap; default: the server chooses");
  stopRecording_ = command("stop-recording", "Stop the recording of a scene on the server");
  for (CLI::App* added :
       {print_, delete_, pause_, resume_, reset_, seek_, speed_, loop_, startRecording_, stopRecording_}) {
    added->add_option("SCENE", options_.name, "Name of the scene")->required();
    takesAddress(added);
  }
  seek_->add_option("SECONDS", options_.seek, "Seconds from the start")->required();
  speed_->add_option("SPEED", options_.speed, "Playback speed; 1 is the recorded speed")->required();
  loop_->add_option("ON", options_.loop, "on or off")->required();
}

void SceneCommands::check() const {
  if (create_->parsed() && options_.file.empty() && options_.named.empty())
    throw CLI::ValidationError("create", "give a FILE, or --named with a scene of the server");
}

bool SceneCommands::parsed() const {
  for (const CLI::App* command : {print_, create_, delete_, pause_, resume_, reset_, seek_, speed_, loop_,
                                  startRecording_, stopRecording_})
    if (command->parsed()) return true;
  return false;
}

ExitCode SceneCommands::print(const ServerAddress& address) const {
  const auto scene = getScene(address, options_.name);
  if (!scene) return printError(scene.error());
  google::protobuf::util::JsonPrintOptions format;
  format.add_whitespace = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(*scene, &json, format);
  if (!status.ok())
    return printError(kFailed, fmt::format("cannot print the scene: {}", std::string(status.message())));
  put(printableJson(json));
  return kOk;
}

ExitCode SceneCommands::create() const {
  CreateSceneOptions create;
  create.named = options_.named;
  create.name = options_.name;
  create.maxParticipants = options_.maxParticipants;
  if (options_.named.empty()) {
    auto scene = readScene(options_.file);
    if (!scene) return printError(kUsage, scene.error());
    create.scene = std::move(*scene);
    for (v1::Cloth& cloth : *create.scene.mutable_cloths()) {
      if (!cloth.has_mesh()) continue;
      if (options_.repair) cloth.mutable_mesh()->set_repair(true);
      if (options_.fit) cloth.mutable_mesh()->set_fit(true);
    }
  }
  if (isatty(STDERR_FILENO) != 0)
    create.progress = [](std::size_t sent, std::size_t all) {
      if (all <= (1 << 20)) return;
      showStatus(stderr, fmt::format("sent {} of {} KiB", sent / 1024, all / 1024));
      if (sent == all) put(stderr, "\n");
    };
  const auto created = createScene(options_.address, create);
  if (!created) return printError(created.error());
  for (const v1::MeshRepair& repair : created->repairs())
    for (const std::string& sentence : repair.sentences())
      cli::print(stderr, "{}: {}\n", repair.cloth(), sentence);
  cli::print("{}\n", created->scene().name());
  return kOk;
}

ExitCode SceneCommands::control(const ServerAddress& address) const {
  v1::ControlSceneRequest request;
  request.set_name(options_.name);
  if (pause_->parsed() || resume_->parsed()) request.set_paused(pause_->parsed());
  request.set_reset(reset_->parsed());
  if (seek_->parsed()) request.set_seek(options_.seek);
  if (speed_->parsed()) request.set_speed(options_.speed);
  if (loop_->parsed()) request.set_loop(options_.loop);
  const auto scene = controlScene(address, request);
  if (!scene) return printError(scene.error());
  if (!scene->has_playback()) return kOk;
  const v1::Playback& playback = scene->playback();
  cli::print("{}: at {:.2f} s of {:.2f} s, speed {}{}{}\n", scene->name(), playback.position(),
             playback.length(), playback.speed(), playback.loop() ? ", in a loop" : "",
             scene->paused() ? ", paused" : "");
  return kOk;
}

ExitCode SceneCommands::record(const ServerAddress& address) const {
  if (startRecording_->parsed()) {
    const auto file = startRecording(address, options_.name, options_.recording);
    if (!file) return printError(file.error());
    cli::print("{}\n", *file);
    return kOk;
  }
  const auto stopped = stopRecording(address, options_.name);
  if (!stopped) return printError(stopped.error());
  cli::print("{}: {:.1f} MiB\n", stopped->file(), static_cast<double>(stopped->bytes()) / (1 << 20));
  return kOk;
}

ExitCode SceneCommands::run(const ServerAddress& address) {
  options_.address = address;
  if (print_->parsed()) return print(address);
  if (create_->parsed()) return create();
  if (delete_->parsed()) return done(deleteScene(address, options_.name));
  if (startRecording_->parsed() || stopRecording_->parsed()) return record(address);
  return control(address);
}

}  // namespace clothstream::cli
