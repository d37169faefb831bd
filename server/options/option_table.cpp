// SPDX-License-Identifier: MIT
// Rows, sources and pages of the table of options.
#include "server/options/option_table.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>
#include <system_error>

#include "server/files/regular_file.h"

namespace clothstream {
namespace {

constexpr std::string_view kEnvironmentPrefix = "CLOTHSTREAM_";
// Variables with this prefix that are not options: of the Vulkan layer, the systemd unit and the tests.
constexpr std::string_view kForeignVariables[] = {"VALIDATION", "LOSE_DEVICE", "OPTIONS", "SERVER",
                                                  "RECORDING",  "SCREENSHOTS", "SANITIZE"};
constexpr std::size_t kPageColumns = 118;
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

std::string toEnvironmentName(std::string name) {
  for (char& c : name) c = c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return std::string(kEnvironmentPrefix) + name;
}

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::vector<std::string> splitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

// Returns nothing if the text is not a decimal number. A number that is too large is infinite.
std::optional<double> parseNumber(std::string_view text, bool whole) {
  constexpr std::string_view kDigits = "0123456789";
  const std::string_view digits = text.substr(text.starts_with('-') ? 1 : 0);
  const bool leadingZero =
      digits.size() > 1 && digits[0] == '0' && std::isdigit(static_cast<unsigned char>(digits[1])) != 0;
  if (leadingZero || digits.find_first_not_of(whole ? kDigits : "0123456789.eE+-") != std::string_view::npos)
    return {};
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (rest != end || error == std::errc::invalid_argument) return {};
  return error == std::errc::result_out_of_range ? std::numeric_limits<double>::infinity() : value;
}

void appendWrapped(std::string& page, std::string_view indent, const std::string& text) {
  std::istringstream words(text);
  std::string line(indent);
  for (std::string word; words >> word;) {
    if (line.size() > indent.size() && line.size() + 1 + word.size() > kPageColumns) {
      page += line + '\n';
      line = indent;
    }
    if (line.size() > indent.size()) line += ' ';
    line += word;
  }
  page += line + '\n';
}

}  // namespace

std::string toText(const NumberRange& range) {
  const bool hasMax = range.max < std::numeric_limits<double>::infinity();
  if (hasMax && range.aboveMin)
    return fmt::format("more than {:.10g}, at most {:.10g}", range.min, range.max);
  if (hasMax) return fmt::format("{:.10g} to {:.10g}", range.min, range.max);
  return range.min > -std::numeric_limits<double>::infinity() ? fmt::format("{:.10g} or more", range.min)
                                                              : "";
}

Check checkNumber(const NumberRange& range, bool whole) {
  return [range, whole](const std::string& text) -> std::string {
    const std::optional<double> value = parseNumber(text, whole);
    if (value && std::isfinite(*value) && *value >= range.min && *value <= range.max &&
        !(range.aboveMin && *value == range.min))
      return {};
    const char* noun = range.noun != nullptr ? range.noun : whole ? "a whole number" : "a number";
    const std::string problem =
        value && range.noun == nullptr ? "is out of range" : fmt::format("is not {}", noun);
    const std::string allowed = toText(range);
    const bool quoted = text.empty() || text.find(' ') != std::string::npos;
    return fmt::format("{} {}; use {}{}", quoted ? fmt::format("'{}'", text) : text, problem,
                       allowed.empty() ? noun : allowed,
                       value ? "" : ", in decimal digits without spaces or leading zeros");
  };
}

Check checkChoice(std::vector<std::string> choices, std::vector<std::string> also) {
  return [choices = std::move(choices), also = std::move(also)](const std::string& text) -> std::string {
    const std::string lower = CLI::detail::to_lower(text);
    if (std::ranges::find(choices, lower) != choices.end() || std::ranges::find(also, lower) != also.end())
      return {};
    return fmt::format("'{}' is not allowed; use {}{}", text, fmt::join(choices, ", "),
                       suggestion(lower, choices));
  };
}

std::string suggestion(std::string_view wrong, const std::vector<std::string>& known,
                       std::string_view prefix) {
  const auto distance = [&](const std::string& name) { return editDistance(wrong, name); };
  const auto nearest = std::ranges::min_element(known, {}, distance);
  if (nearest == known.end() || distance(*nearest) > std::max<std::size_t>(2, nearest->size() / 3)) return {};
  return fmt::format("; did you mean '{}{}'?", prefix, *nearest);
}

OptionTable::OptionTable(CLI::App& program) : program_(program), app_(&program) {}

void OptionTable::group(const char* name) {
  app_ = &program_;
  group_ = name;
}

CLI::App& OptionTable::command(const char* name, const char* help) {
  app_ = program_.add_subcommand(name, help);
  group_ = "Options";
  return *app_;
}

CLI::Option* OptionTable::flag(const char* name, bool& store, const std::string& help) {
  return addRow(Kind::flag, app_->add_flag(name, store), help, nullptr,
                checkChoice({"true", "false"}, {"1", "0", "yes", "no", "on", "off"}));
}

CLI::Option* OptionTable::action(const char* name, bool& store, const std::string& help) {
  return addRow(Kind::action, app_->add_flag(name, store), help, nullptr, {});
}

CLI::Option* OptionTable::word(const char* name, std::string& store, const std::string& help) {
  return addRow(Kind::word, app_->add_option(name, store)->required(), help, nullptr, {});
}

CLI::Option* OptionTable::addRow(Kind kind, CLI::Option* option, const std::string& help, const char* type,
                                 Check check, const std::string& range) {
  option->description(range.empty() ? help : fmt::format("{}. Range: {}", help, range))->group(group_);
  if (type != nullptr) option->type_name(type);
  if (check && kind != Kind::flag) option->check(check);
  rows_.push_back({.kind = kind,
                   .app = app_,
                   .option = option,
                   .name = option->get_single_name(),
                   .help = help,
                   .range = range,
                   .check = std::move(check),
                   .documentedDefault = option->get_default_str()});
  return option;
}

bool OptionTable::isConfigurable(const Row& row) const {
  return row.app == &program_ && row.kind != Kind::action && row.name != "config";
}

std::vector<std::string> OptionTable::configurableNames() const {
  std::vector<std::string> names;
  for (const Row& row : rows_)
    if (isConfigurable(row)) names.push_back(row.name);
  return names;
}

OptionTable::Row* OptionTable::find(const CLI::Option* option) {
  const auto found = std::ranges::find(rows_, option, &Row::option);
  return found == rows_.end() ? nullptr : &*found;
}

void OptionTable::showDefault(const CLI::Option* option, const char* text) {
  find(option)->documentedDefault = text;
}

void OptionTable::exclude(CLI::Option* first, CLI::Option* second) {
  first->excludes(second);
  find(first)->excludes = second;
  find(second)->excludes = first;
}

void OptionTable::retire(const std::vector<std::string>& names, const std::string& instead) {
  for (const std::string& name : names) retired_[name] = instead;
}

std::string OptionTable::hint(const std::string& wrong, const std::vector<std::string>& known,
                              std::string_view prefix) const {
  const auto retired = retired_.find(wrong);
  return retired == retired_.end() ? suggestion(wrong, known, prefix) : "; " + retired->second;
}

std::vector<std::string> OptionTable::applySources(const char* const* environment, const std::string& file) {
  for (Row& row : rows_)
    if (row.option->count() > 0) row.source = Source::commandLine;
  std::vector<std::string> warnings;
  applyEnvironment(environment, warnings);
  if (!file.empty()) applyFile(file);
  return warnings;
}

void OptionTable::applyEnvironment(const char* const* environment, std::vector<std::string>& warnings) {
  std::vector<std::string> variables;
  for (const std::string& name : configurableNames()) variables.push_back(toEnvironmentName(name));
  for (; *environment != nullptr; ++environment) {
    const std::string_view variable(*environment);
    const std::size_t equals = variable.find('=');
    if (!variable.starts_with(kEnvironmentPrefix) || equals == std::string_view::npos) continue;
    const std::string name(variable.substr(0, equals)), value(variable.substr(equals + 1));
    const auto matches = [&](const Row& row) {
      return isConfigurable(row) && toEnvironmentName(row.name) == name;
    };
    const auto row = std::ranges::find_if(rows_, matches);
    const std::string rest = name.substr(kEnvironmentPrefix.size());
    if (row != rows_.end()) {
      if (value.empty()) continue;
      give(*row, Source::environment, name,
           row->kind == Kind::list ? splitAtCommas(value) : std::vector<std::string>{value});
    } else if (rest != "CONFIG" &&
               std::ranges::find(kForeignVariables, rest) == std::end(kForeignVariables)) {
      const auto isSame = [&](const auto& retired) { return toEnvironmentName(retired.first) == name; };
      const auto retired = std::ranges::find_if(retired_, isSame);
      warnings.push_back(
          fmt::format("{} is not an option of this program and is ignored{}", name,
                      retired == retired_.end() ? suggestion(name, variables) : "; " + retired->second));
    }
  }
}

void OptionTable::applyFile(const std::string& file) {
  const auto text = files::readRegularFile(file, kMaxFileBytes);
  if (!text)
    throw OptionError(fmt::format("--config: {} {}; name a readable TOML file", file, text.error().text));
  for (const FileEntry& entry : parseOptionFile(*text, file)) {
    const std::string place = fmt::format("{}:{}: ", file, entry.line);
    const auto matches = [&](const Row& row) { return isConfigurable(row) && row.name == entry.key; };
    const auto row = std::ranges::find_if(rows_, matches);
    if (row == rows_.end())
      throw OptionError(
          fmt::format("{}unknown key '{}'{}", place, entry.key, hint(entry.key, configurableNames())));
    if (row->kind != Kind::list && entry.values.size() != 1)
      throw OptionError(fmt::format("{}{}: use one value, not an array", place, entry.key));
    give(*row, Source::file, place + entry.key, entry.values);
  }
}

void OptionTable::give(Row& row, Source source, const std::string& label,
                       const std::vector<std::string>& values) {
  for (const std::string& value : values)
    if (row.check)
      if (const std::string problem = row.check(value); !problem.empty())
        throw OptionError(fmt::format("{}: {}", label, problem));
  if (row.source >= source || values.empty()) return;
  for (const CLI::App* chosen : program_.get_subcommands())
    if (const CLI::Option* same = chosen->get_option_no_throw("--" + row.name);
        same != nullptr && same->count() > 0)
      return;
  const bool isTrue = CLI::detail::to_flag_value(row.kind == Kind::flag ? values.front() : "true") > 0;
  if (isTrue && row.excludes != nullptr) {
    const Row& other = *find(row.excludes);
    if (other.source > source) return;
    if (other.source == source)
      throw OptionError(fmt::format("{}: cannot be combined with {}; remove one of them", label, other.name));
  }
  row.source = source;
  row.option->add_result(row.kind == Kind::flag ? std::vector<std::string>{isTrue ? "true" : "false"}
                                                : values);
  row.option->run_callback();
}

std::string OptionTable::toToml() const {
  std::string toml, group;
  for (const Row& row : rows_) {
    if (!isConfigurable(row)) continue;
    if (row.option->get_group() != group) {
      group = row.option->get_group();
      toml += fmt::format("{}# {}\n", toml.empty() ? "" : "\n", group);
    }
    if (row.kind == Kind::flag) {
      toml += fmt::format("{} = {}\n", row.name, row.option->as<bool>());
      continue;
    }
    const std::string fallback = row.option->get_default_str();
    std::vector<std::string> values = row.option->results();
    if (values.empty() && !fallback.empty())
      values = row.kind == Kind::list ? splitAtCommas(fallback) : std::vector<std::string>{fallback};
    for (std::string& value : values)
      value = row.kind == Kind::number ? fmt::format("{}", *parseNumber(value, false)) : tomlString(value);
    if (values.empty())
      toml += fmt::format("# {} is not set\n", row.name);
    else if (row.kind == Kind::list)
      toml += fmt::format("{} = [{}]\n", row.name, fmt::join(values, ", "));
    else
      toml += fmt::format("{} = {}\n", row.name, values.back());
  }
  return toml;
}

void OptionTable::describe(std::string& page, const Row& row) const {
  std::string heading = row.kind == Kind::word ? row.name : "--" + row.name;
  if (row.kind != Kind::word && !row.option->get_type_name().empty() && row.option->get_type_size() > 0)
    heading += ' ' + row.option->get_type_name();
  std::string text = fmt::format("- `{}`: {}.", heading, row.help);
  if (!row.range.empty()) text += fmt::format(" Range: {}.", row.range);
  if (!row.documentedDefault.empty()) text += fmt::format(" Default: `{}`.", row.documentedDefault);
  if (row.option->get_required()) text += " Required.";
  std::string wrapped;
  appendWrapped(wrapped, "  ", text);
  page += wrapped.substr(2);
}

std::string OptionTable::toMarkdown() const {
  std::string page, group;
  for (const Row& row : rows_) {
    if (row.app != &program_) continue;
    if (row.option->get_group() != group) {
      group = row.option->get_group();
      page += fmt::format("\n## {}\n\n", group);
    }
    describe(page, row);
  }
  for (const CLI::App* command : program_.get_subcommands({})) {
    page += fmt::format("\n## Command `{}`\n\n", command->get_name());
    appendWrapped(page, "", command->get_description() + ".");
    bool first = true;
    for (const Row& row : rows_) {
      if (row.app != command) continue;
      if (std::exchange(first, false)) page += '\n';
      describe(page, row);
    }
  }
  return page;
}

std::string OptionTable::unexpected(const std::string& word) const {
  const bool isOption = word.starts_with('-');
  std::vector<std::string> known;
  if (isOption) {
    const auto chosen = program_.get_subcommands();
    for (const Row& row : rows_)
      if (row.kind != Kind::word &&
          (row.app == &program_ || std::ranges::find(chosen, row.app) != chosen.end()))
        known.push_back(row.name);
  } else {
    for (const CLI::App* command : program_.get_subcommands({})) known.push_back(command->get_name());
  }
  const std::string name = word.substr(std::min(word.find_first_not_of('-'), word.size()));
  if (!isOption) return fmt::format("{}: unknown command{}", word, suggestion(word, known));
  return fmt::format("{}: unknown option{}", word, hint(name.substr(0, name.find('=')), known, "--"));
}

}  // namespace clothstream
