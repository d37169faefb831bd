// SPDX-License-Identifier: MIT
// One table of options. Its rows define the command line, --help, the documentation page, option files,
// environment variables and --print-config.
#pragma once

#include <chrono>
#include <concepts>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "server/options/option_file.h"

namespace clothstream {

// Range of a numeric option, both ends included, and its name in --help. Infinite numbers are never allowed.
struct NumberRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  const char* type = "N";
  const char* noun = nullptr;  // for errors: "70000 is not a port"
  bool aboveMin = false;       // min itself is not allowed
};

// Returns an error for a value that is not allowed, empty for one that is.
using Check = std::function<std::string(const std::string&)>;

// Numbers are decimal, such as 12, -3, .5 and 2.5e-3. Spaces, a plus sign, leading zeros and prefixes such as
// 0x are errors.
Check checkNumber(const NumberRange& range, bool whole);
// One of `choices`, case ignored; `also` are accepted but not shown.
Check checkChoice(std::vector<std::string> choices, std::vector<std::string> also = {});
std::string toText(const NumberRange& range);

// The known name that is closest to a mistyped one as "; did you mean 'NAME'?", or empty if none is close.
std::string suggestion(std::string_view wrong, const std::vector<std::string>& known,
                       std::string_view prefix = "");

// Type of the value that `Store` keeps.
template <typename Store>
struct ValueOf {
  using type = Store;
};
template <typename T>
struct ValueOf<std::optional<T>> : ValueOf<T> {};
template <typename Rep, typename Period>
struct ValueOf<std::chrono::duration<Rep, Period>> {
  using type = double;  // seconds
};

// Stores a value of type ValueOf<Store>.
template <typename Store, typename Value>
void assign(Store& store, Value value) {
  store = value;
}
template <typename Rep, typename Period>
void assign(std::chrono::duration<Rep, Period>& store, double seconds) {
  using Duration = std::chrono::duration<Rep, Period>;
  store = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}
template <typename T, typename Value>
void assign(std::optional<T>& store, Value value) {
  assign(store.emplace(), value);
}

class OptionTable {
 public:
  explicit OptionTable(CLI::App& program);

  // Starts a group of the program's options. They may come from every source.
  void group(const char* name);
  // Starts the options of a command. They come from the command line only.
  CLI::App& command(const char* name, const char* help);

  // `store` keeps its value if no source sets the option. It must outlive the table. A duration is given in
  // seconds.
  template <typename Store>
  CLI::Option* number(const char* name, Store& store, const NumberRange& range, const std::string& help);
  template <typename Store>
  CLI::Option* text(const char* name, Store& store, const char* type, const std::string& help,
                    Check check = {});
  template <typename T>
  CLI::Option* choice(const char* name, std::optional<T>& store, const std::map<std::string, T>& choices,
                      const std::string& help);
  // An option that may be given several times. Separated by commas in environment variables.
  template <typename T>
  CLI::Option* list(const char* name, std::vector<T>& store, const char* type, const std::string& help,
                    Check check = {});
  CLI::Option* flag(const char* name, bool& store, const std::string& help);
  // A flag of the command line that is done instead of serving, such as --list-devices.
  CLI::Option* action(const char* name, bool& store, const std::string& help);
  // A required positional argument of a command.
  CLI::Option* word(const char* name, std::string& store, const std::string& help);

  // Sets a default that differs between machines as --help and the documentation show it.
  void showDefault(const CLI::Option* option, const char* text);
  // Makes two options exclusive. One source may set only one of them. Of two sources, the stronger one wins.
  void exclude(CLI::Option* first, CLI::Option* second);

  // Names that are no options any more. Errors about them end with `instead`, such as "use --profile".
  void retire(const std::vector<std::string>& names, const std::string& instead);

  // Called after the command line was parsed: gives the options that are still unset their values from the
  // environment, then from the file. `environment` is a list of NAME=VALUE. An empty `file` means none.
  // Returns warnings. Throws OptionError.
  std::vector<std::string> applySources(const char* const* environment, const std::string& file);

  // Effective values as an option file.
  std::string toToml() const;
  std::string toMarkdown() const;
  // Error for an unknown word of the command line.
  std::string unexpected(const std::string& word) const;

 private:
  enum class Kind { number, text, list, flag, action, word };
  enum class Source { unset, file, environment, commandLine };
  struct Row {
    Kind kind;
    CLI::App* app;
    CLI::Option* option;
    std::string name;  // without dashes
    std::string help;
    std::string range;  // of a number, for people
    Check check;
    std::string documentedDefault;
    CLI::Option* excludes = nullptr;
    Source source = Source::unset;
  };

  CLI::Option* addRow(Kind kind, CLI::Option* option, const std::string& help, const char* type, Check check,
                      const std::string& range = "");
  bool isConfigurable(const Row& row) const;
  std::vector<std::string> configurableNames() const;
  // Says what to use instead of an option (without dashes) that the program does not have, or returns "".
  std::string hint(const std::string& wrong, const std::vector<std::string>& known,
                   std::string_view prefix = "") const;
  Row* find(const CLI::Option* option);
  void applyEnvironment(const char* const* environment, std::vector<std::string>& warnings);
  void applyFile(const std::string& file);
  // Sets the option unless a stronger source, the chosen command or an alternative has set it.
  void give(Row& row, Source source, const std::string& label, const std::vector<std::string>& values);
  void describe(std::string& page, const Row& row) const;

  CLI::App& program_;
  CLI::App* app_;
  std::string group_;
  std::vector<Row> rows_;
  std::map<std::string, std::string> retired_;  // what to do instead, by name
};

template <typename Store>
CLI::Option* OptionTable::number(const char* name, Store& store, const NumberRange& range,
                                 const std::string& help) {
  using Value = typename ValueOf<Store>::type;
  CLI::Option* option =
      app_->add_option_function<Value>(name, [&store](const Value& value) { assign(store, value); });
  if constexpr (requires { store.count(); })
    option->default_str(fmt::format("{}", std::chrono::duration<double>(store).count()));
  else if constexpr (!requires { store.has_value(); })
    option->default_str(fmt::format("{}", store));
  return addRow(Kind::number, option, help, range.type, checkNumber(range, std::integral<Value>),
                toText(range));
}

template <typename Store>
CLI::Option* OptionTable::text(const char* name, Store& store, const char* type, const std::string& help,
                               Check check) {
  CLI::Option* option =
      app_->add_option_function<std::string>(name, [&store](const std::string& value) { store = value; });
  option->default_str(std::string(store));
  return addRow(Kind::text, option, help, type, std::move(check));
}

template <typename T>
CLI::Option* OptionTable::choice(const char* name, std::optional<T>& store,
                                 const std::map<std::string, T>& choices, const std::string& help) {
  std::vector<std::string> names;
  names.reserve(choices.size());
  for (const auto& [choice, value] : choices) names.push_back(choice);
  CLI::Option* option = app_->add_option_function<std::string>(
      name,
      [&store, choices](const std::string& value) { store = choices.at(CLI::detail::to_lower(value)); });
  return addRow(Kind::text, option, help, "NAME", checkChoice(names));
}

template <typename T>
CLI::Option* OptionTable::list(const char* name, std::vector<T>& store, const char* type,
                               const std::string& help, Check check) {
  CLI::Option* option = app_->add_option_function<std::vector<std::string>>(
      name, [&store](const std::vector<std::string>& values) { store.assign(values.begin(), values.end()); });
  return addRow(Kind::list, option, help, type, std::move(check));
}

}  // namespace clothstream
