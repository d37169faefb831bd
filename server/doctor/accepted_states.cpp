// SPDX-License-Identifier: MIT
// Hashes after a thousand ticks on Mesa's software device (lavapipe of Mesa 22.3.6). `clothstream-server step
// --scene NAME --ticks 1000 --every 1000 --out FILE` prints one into FILE.json.
#include "server/doctor/acceptance.h"

namespace clothstream::doctor {
namespace {

constexpr AcceptedState kStates[] = {
    {"balloon", 0xda6bbeea981c11fdu},
    {"curtain", 0x207b382b6d173870u},
    {"cushion", 0x5704e0d35e06026bu},
    {"dress", 0xaa70c87c5aaa5043u},
    {"figure_07", 0x864e4a384e8321c7u},
    {"figure_09", 0x944757b9bb8a4642u},
    {"figure_10", 0x75795af652c671d5u},
    {"figure_11", 0x7d741754d2295e62u},
    {"figure_12", 0x29e742423ba6637au},
    {"figure_13", 0xbceb4aba2160d0ecu},
    {"figure_14", 0x0e74589359ad1a5fu},
    {"figure_15", 0x236b053bf25874e8u},
    {"flag", 0x4aec43f3a916dfafu},
    {"folds", 0x5081340b01b55416u},
    {"gown", 0x0b87a1cab523a801u},
    {"obstacles", 0x616ce6f10a7ba85du},
    {"solver_acad", 0xec9a152b77f0cddfu},
    {"solver_constraint", 0xe4f72c0d1a0900a9u},
    {"solver_implicit_euler", 0x97bf26436194655fu},
    {"solver_mass_spring", 0xe51bd479346f4303u},
    {"solver_xpbd", 0xfdb02027c9fb9219u},
    {"sphere_drop", 0x247a45534a2921c0u},
    {"swing", 0xfea3279062ed322au},
    {"tablecloth", 0xcc4182a9686e786du},
    {"veil", 0x505afda997adf1fcu},
    {"walker", 0xcbccf758556c139bu},
};

}  // namespace

std::span<const AcceptedState> acceptedStates() {
  return kStates;
}

}  // namespace clothstream::doctor
