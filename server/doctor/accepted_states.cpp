// SPDX-License-Identifier: MIT
// Hashes after a thousand ticks on Mesa's software device (lavapipe of Mesa 22.3.6). `clothstream-server step
// --scene NAME --ticks 1000 --every 1000 --out FILE` prints one into FILE.json.
#include "server/doctor/acceptance.h"

namespace clothstream::doctor {
namespace {

constexpr AcceptedState kStates[] = {
    {"curtain", 0xda25e8fe29f88999u},
    {"figure_07", 0x09edb1bc41faac7du},
    {"figure_09", 0x33955d57d4337398u},
    {"figure_10", 0xfc5608dbc9071051u},
    {"figure_11", 0x44223363f3e8a3d0u},
    {"figure_12", 0xf48d2125782b8583u},
    {"figure_13", 0x2308cba7d9b96907u},
    {"figure_14", 0xeb14c42efc818018u},
    {"figure_15", 0xf9c2724392e2f912u},
    {"flag", 0x4aec43f3a916dfafu},
    {"folds", 0x12909ab80ed34b3fu},
    {"obstacles", 0x59f2d5fd80089531u},
    {"solver_acad", 0xa2df7c5cfba651bbu},
    {"solver_constraint", 0x10a6d6a5e38f4bdfu},
    {"solver_implicit_euler", 0xe9c7991c43bc2cd1u},
    {"solver_mass_spring", 0x7b1d91dc4ba0dcbau},
    {"solver_xpbd", 0x633ad344f5968973u},
    {"sphere_drop", 0x066019558aa11986u},
    {"swing", 0xfea3279062ed322au},
    {"tablecloth", 0xebe878aa5db74485u},
    {"veil", 0xa27e50da2575825au},
    {"walker", 0xcbaae6db07bba8acu},
};

}  // namespace

std::span<const AcceptedState> acceptedStates() {
  return kStates;
}

}  // namespace clothstream::doctor
