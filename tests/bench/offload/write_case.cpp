// SPDX-License-Identifier: MIT
// Writes what offload.mjs compares: the stream of a cloth as the server sends it, and the same cloth for a
// client that simulates it, with the results that the double-precision reference has for one tick.
//
// OUT.json holds numbers and, for every array of OUT.bin, its place in floats or bytes.
#include <array>
#include <bit>
#include <cstdio>
#include <exception>
#include <fstream>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "server/messages/scene_file.h"
#include "server/reference/reference_simulation.h"
#include "tests/bench/offload/recorded_stream.h"
#include "tests/bench/resized.h"
#include "tests/bench/simulated.h"

namespace {

using namespace clothstream;
using nlohmann::ordered_json;

// Tick of the check: the ball is in the middle of the curtain.
constexpr std::uint32_t kCheckTick = 90;
// Exit status without a Vulkan device.
constexpr int kSkipped = 77;

// The scene `curtain` without air, at another size.
model::Scene curtainOf(std::uint32_t size) {
  auto scene = messages::loadScene("curtain");
  if (!scene) throw std::runtime_error(scene.error().text);
  scene->environment.airDensity = 0;
  bench::resize(scene->cloths.front(), size);
  bench::raiseSubsteps(*scene);
  return std::move(*scene);
}

class Arrays {
 public:
  explicit Arrays(const std::string& path) : path_(path), file_(path, std::ios::binary) {}

  // Returns the place of the bytes in the file, which starts at a multiple of four.
  ordered_json add(std::span<const std::byte> bytes) {
    const ordered_json place = {at_, bytes.size()};
    file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    at_ += bytes.size();
    constexpr std::array<char, 4> kNothing{};
    file_.write(kNothing.data(), static_cast<std::streamsize>(-at_ % 4));
    at_ += -at_ % 4;
    return place;
  }
  ordered_json add(const std::vector<float>& floats) { return add(std::as_bytes(std::span(floats))); }
  ordered_json add(const std::vector<delivery::SharedBytes>& messages) {
    ordered_json places = ordered_json::array();
    for (const auto& message : messages) places.push_back(add(std::span(*message)));
    return places;
  }
  void finish() {
    if (!file_.flush()) throw std::runtime_error(path_ + " cannot be written");
  }

 private:
  std::string path_;
  std::ofstream file_;
  std::size_t at_ = 0;
};

std::vector<float> floatsOf(const simulation::NodeState& state) {
  std::vector<float> floats;
  for (std::size_t node = 0; node < state.positions.size(); ++node)
    for (const model::Vec3& vector : {state.positions[node], state.velocities[node]})
      floats.insert(floats.end(), {vector.x(), vector.y(), vector.z()});
  return floats;
}

std::vector<float> floatsOf(std::span<const reference::Vec3> vectors) {
  std::vector<float> floats;
  for (const reference::Vec3& vector : vectors)
    for (int axis = 0; axis < 3; ++axis) floats.push_back(static_cast<float>(vector[axis]));
  return floats;
}

// As in Simulated::check(): each substep rounds a position once, to 2^-24 of the cloth's extent, and twelve
// springs pass on the rounding of their ends. The rest is far above that and far below the effect of any
// missing term.
double toleranceOf(const model::Scene& scene) {
  const model::Grid& grid = scene.cloths.front().grid;
  const double extent = std::max(double{grid.width}, double{grid.height});
  return scene.substeps * 20 * extent / (1 << 24) + double{model::spacing(grid).column} / 8000;
}

ordered_json numbersOf(const model::Scene& scene) {
  const model::Cloth& cloth = scene.cloths.front();
  const model::Collider& ball = scene.colliders.front();
  const model::GridSpacing spacing = model::spacing(cloth.grid);
  const float radius = std::get<model::Sphere>(ball.shape).radius;
  // In the order of Settings in cloth.h.
  const ordered_json settings = {spacing.column,
                                 spacing.row,
                                 spacing.diagonal,
                                 1 / cloth.nodeMass(),
                                 cloth.structural.stiffness,
                                 cloth.structural.damping,
                                 cloth.shear.stiffness,
                                 cloth.shear.damping,
                                 cloth.bend.stiffness,
                                 cloth.bend.damping,
                                 cloth.damping,
                                 scene.environment.gravity.y(),
                                 cloth.friction * ball.friction,
                                 radius + cloth.thickness,
                                 scene.substepSeconds()};
  return {
      {"rows", cloth.grid.rows},      {"columns", cloth.grid.columns},   {"substeps", scene.substeps},
      {"rate", scene.simulationRate}, {"tolerance", toleranceOf(scene)}, {"maxError", scene.stream.maxError},
      {"settings", settings}};
}

// Moves every free node a little, so that every term of the forces acts.
void disturb(const model::Scene& scene, simulation::NodeState& state) {
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  const float reach = 0.1f * model::spacing(scene.cloths.front().grid).column;
  constexpr float kSpeed = 0.5f;  // m/s
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (std::size_t node = 0; node < masses.size(); ++node) {
    if (masses[node] == 0) continue;
    state.positions[node] += reach * model::Vec3(unit(random), unit(random), unit(random));
    state.velocities[node] += kSpeed * model::Vec3(unit(random), unit(random), unit(random));
  }
}

ordered_json expectedOf(const model::Scene& scene, const simulation::NodeState& start, Arrays& arrays) {
  reference::ReferenceSimulation reference(scene);
  reference::ReferenceCloth& cloth = reference.cloths().front();
  for (std::size_t node = 0; node < start.positions.size(); ++node) {
    cloth.positions()[node] = start.positions[node].cast<double>();
    cloth.velocities()[node] = start.velocities[node].cast<double>();
  }
  reference.tick(reference::inputsAt(scene, kCheckTick));
  return {{"positions", arrays.add(floatsOf(cloth.positions()))},
          {"normals", arrays.add(floatsOf(cloth.normals()))}};
}

void write(vulkan::Device& device, std::uint32_t size, std::uint32_t frames, const std::string& out) {
  model::Scene scene = curtainOf(size);
  Arrays arrays(out + ".bin");
  ordered_json description = numbersOf(scene);

  const bench::offload::RecordedStream stream = bench::offload::recordStream(device, scene, frames);
  description["before"] = arrays.add(stream.before);
  description["frames"] = arrays.add(stream.frames);

  bench::Simulated simulated(device, scene, {});
  for (std::uint32_t tick = 0; tick < kCheckTick; ++tick) simulated.tick(simulation::inputsAt(scene, tick));
  if (simulated.status().stateHash != stream.stateHashes[kCheckTick - 1])
    throw std::runtime_error("the stream shows another motion than the simulation");

  std::vector<float> ball;
  for (std::uint32_t tick = 0; tick <= frames; ++tick) {
    const model::Vec3 centre = model::poseAt(scene.colliders.front(), tick * scene.tickSeconds()).position;
    ball.insert(ball.end(), {centre.x(), centre.y(), centre.z()});
  }
  description["ball"] = arrays.add(ball);
  description["inverseMasses"] = arrays.add(simulation::inverseMasses(scene.cloths));
  description["start"] = arrays.add(floatsOf(simulation::restState(scene.cloths)));
  simulation::NodeState state = simulated.state();
  disturb(scene, state);
  description["check"]["tick"] = kCheckTick;
  description["check"]["start"] = arrays.add(floatsOf(state));
  description["check"]["massSpring"] = expectedOf(scene, state, arrays);
  scene.cloths.front().solver.kind = model::SolverKind::xpbd;
  scene.cloths.front().solver.iterations = 1;
  description["check"]["xpbd"] = expectedOf(scene, state, arrays);
  arrays.finish();

  std::ofstream file(out + ".json");
  file << description.dump() << '\n';
  if (!file.flush()) throw std::runtime_error(out + ".json cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  static_assert(std::endian::native == std::endian::little, "OUT.bin is little-endian");
  CLI::App app{"Writes the stream of a curtain and the curtain itself for offload.mjs."};
  std::uint32_t size = 0, frames = 360;
  std::string out;
  vulkan::DeviceOptions device;
  app.add_option("--size", size, "Rows and columns of the cloth")->required()->check(CLI::Range(8, 512));
  app.add_option("--frames", frames, "Frames at 72 Hz")
      ->check(CLI::Range(kCheckTick, 7200u))
      ->capture_default_str();
  app.add_option("--device", device.select, "Index or part of the name of the Vulkan device");
  app.add_option("out", out, "Path of the files without ending")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    vulkan::Device opened(device);
    write(opened, size, frames, out);
  } catch (const vulkan::DeviceError& error) {
    fmt::print(stderr, "write_offload_case: {}\n", error.what());
    return kSkipped;
  } catch (const std::exception& error) {
    fmt::print(stderr, "write_offload_case: {}\n", error.what());
    return 1;
  }
  return 0;
}
