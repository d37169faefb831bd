// SPDX-License-Identifier: MIT
// Suite doctor: the machine, and what `clothstream-server doctor --accept` finds about its device. A row is a
// finding with its figures.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <thread>

#include <fmt/format.h>

#include "server/doctor/acceptance.h"
#include "server/doctor/device.h"
#include "server/simulation/software_threads.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

Row rowOf(const doctor::Finding& finding, const vulkan::Device& device) {
  Row row{{"suite", "doctor"}};
  row.update(doctor::toJson(doctor::Findings{finding}).front());
  row.erase("figures");
  if (!finding.figures.is_null()) row.update(finding.figures);
  row["device"] = device.info().name;
  return row;
}

doctor::Finding machine(const vulkan::Device& device) {
  return {.level = doctor::Level::good,
          .topic = "machine",
          .text = fmt::format("{}, {}, Vulkan {}, {} CPU threads", device.info().name, device.info().driver,
                              device.info().apiVersion, std::thread::hardware_concurrency())};
}

doctor::Finding accept(const doctor::OptionsFor& optionsFor, const doctor::AcceptedState& expected) {
  try {
    return doctor::accept(optionsFor, expected, [] { return false; });
  } catch (const std::exception& error) {
    return {.level = doctor::Level::problem,
            .topic = "acceptance",
            .text = fmt::format("{}: {}", expected.scene, error.what()),
            .figures = {{"scene", expected.scene}}};
  }
}

}  // namespace

void runDoctor(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because every scene has its size");
  const auto optionsFor = [&](std::uint32_t nodes) { return simulation::suitedTo(nodes, settings.device); };
  const auto chosen = [&](std::string_view scene) {
    return settings.scenes.empty() || std::ranges::count(settings.scenes, scene) > 0;
  };
  const auto report = [&](const doctor::Finding& finding) { add(rowOf(finding, device)); };
  report(machine(device));
  for (const doctor::Finding& finding : doctor::checkDevices(optionsFor(0))) report(finding);
  std::size_t scenes = 0, wrong = 0;
  for (const doctor::AcceptedState& expected : doctor::acceptedStates())
    if (chosen(expected.scene)) {
      const doctor::Finding finding = accept(optionsFor, expected);
      report(finding);
      ++scenes;
      if (finding.level == doctor::Level::problem) ++wrong;
    }
  if (scenes < settings.scenes.size())
    throw std::runtime_error("--scene: not the name of a built-in scene, or twice the same");
  // Two sizes are searched.
  const std::chrono::duration<double> time(2 * settings.seconds);
  for (const doctor::Finding& finding : doctor::measureCapacity(optionsFor, time)) report(finding);
  if (wrong > 0) throw std::runtime_error(fmt::format("{} scenes have wrong states", wrong));
}

}  // namespace clothstream::bench
