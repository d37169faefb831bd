// SPDX-License-Identifier: MIT
// Compiles the kernels of scenes, and collects what the compiler says about them.
#include "tests/kernel_survey/survey.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

#include "server/encode/frame_encoder.h"
#include "server/vulkan/recorder.h"
#include "tests/model/surfaces.h"

namespace clothstream::kernel_survey {
namespace {

using Key = std::tuple<std::string, std::string, std::uint32_t>;

// Bytes and invocations of a kernel's dispatch in one scene.
struct Extent {
  double bytes = 0, invocations = 0;
};

std::string settingsOf(const vulkan::Kernel& kernel) {
  std::string text;
  for (const auto& [id, constant] : kernel.interface().constants) {
    if (id > kernel.specialisation().size()) continue;
    const std::uint32_t value = kernel.specialisation()[id - 1];
    if (constant.isBool && value == 0) continue;
    if (!text.empty()) text += ", ";
    text += constant.isBool ? constant.name : fmt::format("{} {}", constant.name, value);
  }
  return text;
}

// Lists of the colliders near a run of nodes. Most of their room is empty.
constexpr std::string_view kSparse = "nearColliders";

// Bytes of the bound buffers. A buffer that is bound twice is read and written once.
double bytesOf(const vulkan::Bindings& bindings) {
  std::set<const void*> read, written;
  double bytes = 0;
  const std::span<const vulkan::Binding> access = bindings.kernel().interface().bindings;
  for (std::size_t i = 0; i < access.size(); ++i) {
    if (access[i].name == kSparse) continue;
    const vulkan::BoundBuffer& buffer = bindings.buffers()[i];
    if (access[i].reads && read.insert(buffer.identity).second) bytes += static_cast<double>(buffer.bytes);
    if (access[i].writes && written.insert(buffer.identity).second)
      bytes += static_cast<double>(buffer.bytes);
  }
  return bytes;
}

// The objects of one scene. Kernels stay while they exist, so that a second scene shares them.
class CompiledScene {
 public:
  CompiledScene(vulkan::Device& device, const model::Scene& scene,
                const simulation::SimulationOptions& options)
      : simulation_(device, scene, options),
        encoder_(device, simulation_, encode::streamLayout(scene, 1)),
        recorder_(device) {
    simulation::TickInputs inputs{scene.environment, {}};
    inputs.namesConstraints = true;
    recorder_.beginRehearsal();
    // Frames are not submitted, and so stay in their slots.
    static_assert(encode::FrameEncoder::kSlots >= 2);
    for (int tick = 0; tick < 2; ++tick) {
      simulation_.recordTick(recorder_, inputs);
      simulation_.recordReport(recorder_, inputs);
      if (scene.stream.normals == model::Normals::octahedral) simulation_.recordNormals(recorder_);
      encoder_.record(recorder_, static_cast<std::uint64_t>(tick + 1), false);
      inputs = simulation::inputsAt(scene, 1);
      inputs.namesConstraints = true;
      for (simulation::MovingCollider& collider : inputs.colliders) collider.jumped = true;
      inputs.colliders.emplace_back();
      inputs.surfaces = {{.table = simulation::makeSurfaceTable(model::surfaceOf(model::flat(1, 1)))}};
      inputs.grabs.push_back({.state = simulation::Grab::State::takes});
      inputs.carries.push_back({});
    }
    std::vector<model::Cloth> heavier = scene.cloths;
    for (model::Cloth& cloth : heavier) cloth.mass *= 2;
    simulation_.setCloths(heavier);
    simulation_.recordTick(recorder_, inputs);
  }

  std::span<const vulkan::RehearsedKernel> kernels() const { return recorder_.rehearsed(); }

 private:
  simulation::ClothSimulation simulation_;
  encode::FrameEncoder encoder_;
  vulkan::Recorder recorder_;
};

class Collection {
 public:
  explicit Collection(vulkan::Device& device) : device_(device) {}

  void add(const SurveyScene& survey, const simulation::SimulationOptions& options) {
    const CompiledScene compiled(device_, survey.scene, options);
    std::map<Key, Extent> extents;
    for (const vulkan::RehearsedKernel& rehearsed : compiled.kernels())
      extents[note(rehearsed, survey.name)] = extentOf(rehearsed);
    if (!survey.larger) return;
    const auto nodes = static_cast<double>(survey.larger->nodeCount() - survey.scene.nodeCount());
    const CompiledScene larger(device_, *survey.larger, options);
    for (const vulkan::RehearsedKernel& rehearsed : larger.kernels()) {
      const Key key = note(rehearsed, survey.name);
      const auto smaller = extents.find(key);
      SurveyedKernel& kernel = kernels_[places_.at(key)];
      if (smaller == extents.end() || kernel.bytesPerNode) continue;
      const Extent extent = extentOf(rehearsed);
      if (extent.invocations <= smaller->second.invocations) continue;
      kernel.bytesPerNode = (extent.bytes - smaller->second.bytes) / nodes;
      kernel.invocationsPerNode = (extent.invocations - smaller->second.invocations) / nodes;
    }
  }

  std::vector<SurveyedKernel> take() { return std::move(kernels_); }

 private:
  Extent extentOf(const vulkan::RehearsedKernel& rehearsed) {
    return {bytesOf(*rehearsed.bindings), static_cast<double>(rehearsed.invocations)};
  }

  Key note(const vulkan::RehearsedKernel& rehearsed, const std::string& scene) {
    const vulkan::Kernel& kernel = rehearsed.bindings->kernel();
    const Key key{std::string(kernel.name()), settingsOf(kernel), kernel.workgroupSize()};
    const auto [place, isNew] = places_.try_emplace(key, kernels_.size());
    if (isNew)
      kernels_.push_back({.kernel = std::string(kernel.name()),
                          .settings = std::get<1>(key),
                          .workgroupSize = kernel.workgroupSize(),
                          .subgroupSize = vulkan::subgroupSizeOf(device_, kernel),
                          .firstScene = scene,
                          .statistics = vulkan::statisticsOf(device_, kernel)});
    SurveyedKernel& surveyed = kernels_[place->second];
    if (lastScene_[key] != scene) ++surveyed.scenes;
    lastScene_[key] = scene;
    return key;
  }

  vulkan::Device& device_;
  std::map<Key, std::size_t> places_;
  std::map<Key, std::string> lastScene_;
  std::vector<SurveyedKernel> kernels_;
};

}  // namespace

std::optional<double> SurveyedKernel::statistic(std::string_view name) const {
  const auto found = std::ranges::find(statistics, name, &vulkan::KernelStatistic::name);
  return found == statistics.end() ? std::nullopt : std::optional(found->value);
}

std::vector<SurveyedKernel> survey(vulkan::Device& device, std::span<const SurveyScene> scenes,
                                   const simulation::SimulationOptions& options) {
  Collection collection(device);
  for (const SurveyScene& scene : scenes) collection.add(scene, options);
  return collection.take();
}

}  // namespace clothstream::kernel_survey
