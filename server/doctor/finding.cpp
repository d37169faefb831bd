// SPDX-License-Identifier: MIT
#include "server/doctor/finding.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

namespace clothstream::doctor {
namespace {

const char* nameOf(Level level) {
  constexpr const char* kNames[] = {"ok", "advice", "problem"};
  return kNames[static_cast<std::size_t>(level)];
}

}  // namespace

std::string toText(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += fmt::format("{:<8} {:<12} {}\n", nameOf(finding.level), finding.topic, finding.text);
    if (!finding.fix.empty()) text += fmt::format("{:<21} {}\n", "", finding.fix);
  }
  return text;
}

nlohmann::ordered_json toJson(const Findings& findings) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Finding& finding : findings) {
    nlohmann::ordered_json one{
        {"level", nameOf(finding.level)}, {"topic", finding.topic}, {"text", finding.text}};
    if (!finding.fix.empty()) one["fix"] = finding.fix;
    if (!finding.figures.is_null()) one["figures"] = finding.figures;
    all.push_back(std::move(one));
  }
  return all;
}

bool hasProblem(const Findings& findings) {
  return std::ranges::any_of(findings,
                             [](const Finding& finding) { return finding.level == Level::problem; });
}

}  // namespace clothstream::doctor
