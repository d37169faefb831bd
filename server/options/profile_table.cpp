// SPDX-License-Identifier: MIT
#include "server/options/profile_table.h"

#include <fmt/format.h>

namespace clothstream {
namespace {

using hosting::Profile;

std::string nameOf(Profile profile) {
  return hosting::kProfileNames[static_cast<std::size_t>(profile)];
}

}  // namespace

std::string profilesAsText() {
  constexpr const char* kLine = "  {:<54}{:>16}{:>16}{:>16}\n";
  std::string text = fmt::format(kLine, "Limits of --profile", nameOf(Profile::home), nameOf(Profile::open),
                                 nameOf(Profile::fleet));
  for (const hosting::LimitRow& row : hosting::limitTable())
    text += fmt::format(kLine, row.what, valueText(row, Profile::home), valueText(row, Profile::open),
                        valueText(row, Profile::fleet));
  return text;
}

std::string profilesAsMarkdown() {
  std::string page = fmt::format(
      "\n## Profiles\n\n"
      "`--profile` sets these limits. One that names an option can also be set alone, and the option then "
      "wins.\n\n"
      "| limit | option | {} | {} | {} |\n|---|---|---|---|---|\n",
      nameOf(Profile::home), nameOf(Profile::open), nameOf(Profile::fleet));
  for (const hosting::LimitRow& row : hosting::limitTable()) {
    const std::string option = row.option == nullptr ? "" : fmt::format("`--{}` ", row.option);
    page += fmt::format("| {} | {}| {} | {} | {} |\n", row.what, option, valueText(row, Profile::home),
                        valueText(row, Profile::open), valueText(row, Profile::fleet));
  }
  return page;
}

std::string limitsAsComments(Profile profile) {
  std::string text = fmt::format("\n# Limits of the profile {}\n", nameOf(profile));
  for (const hosting::LimitRow& row : hosting::limitTable())
    if (row.option == nullptr) text += fmt::format("# {}: {}\n", row.what, valueText(row, profile));
  return text;
}

}  // namespace clothstream
