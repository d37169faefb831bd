// SPDX-License-Identifier: MIT
// Commands that print what the program knows: devices, materials and scenes.
#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "server/model/material.h"
#include "server/program/commands.h"
#include "server/program/scenes.h"
#include "server/vulkan/device.h"

namespace clothstream::program {

int printScene(const std::string& nameOrPath) {
  fmt::print("{}\n", messages::toJson(loadScene(nameOrPath)));
  return 0;
}

int listDevices() {
  for (const vulkan::DeviceInfo& device : vulkan::listDevices())
    fmt::print("{}  {}\n", device.index, vulkan::describe(device));
  return 0;
}

int listMaterials() {
  fmt::print("{:<12}{:>8}{:>10}{:>8}{:>10}  {}\n", "", "kg/m^2", "N/m", "shear", "uN m", "");
  for (const model::Material& material : model::materials())
    fmt::print("{:<12}{:>8}{:>10}{:>8}{:>10.3g}  {}\n", material.name, material.arealMass, material.tension,
               material.shear, 1e6 * double{material.rigidity}, material.description);
  return 0;
}

}  // namespace clothstream::program
