// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>

#include "commands.h"
#include "parameter_text.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/configuration.h"

namespace planar_mapping::tools {
namespace {

/// \p key is "stage.key", or a key that may occur in several stages.
std::string explain(const StageTable& table, const std::string& key) {
  std::string text;
  const std::size_t dot = key.find('.');
  const std::string stage = dot == std::string::npos ? "" : key.substr(0, dot);
  const std::string name = dot == std::string::npos ? key : key.substr(dot + 1);
  for (const StageEntry& entry : table.entries()) {
    if (!stage.empty() && entry.name != stage) continue;
    const auto made = entry.make();
    ParameterTable parameters;
    made->declare(parameters);
    if (parameters.find(name) != nullptr) text += describeParameter(entry, name);
  }
  if (text.empty()) {
    throw UsageError("no stage has a key '" + key + "'; planar_map config --defaults shows all");
  }
  return text;
}

/// Nothing is executed: without its plugins a file cannot be resolved.
std::string effective(const std::string& path, StageTable& table,
                      const ConfigurationOverrides& overrides) {
  const Configuration configuration = loadConfiguration(path, table, overrides, Plugins::Ignore);
  if (configuration.unknown_stages.empty()) return effectiveYaml(configuration);
  throw ConfigError({path + ":1:1: stage '" + configuration.unknown_stages.front() +
                     "' is of a plugin, which run alone loads; config.resolved.yaml of a run has "
                     "all values"});
}

}  // namespace

void addConfigCommand(CLI::App& app, int&) {
  struct Arguments {
    bool defaults = false;
    std::string explain;
    std::string effective;
    ConfigurationOverrides overrides;
    std::string profile;
  };
  auto* command =
      app.add_subcommand("config", "All keys with unit, range, default, meaning; resolved files");
  const auto arguments = std::make_shared<Arguments>();
  auto* what = command->add_option_group("what");
  what->add_flag("--defaults", arguments->defaults, "Every stage with every key");
  what->add_option("--explain", arguments->explain, "A key: KEY or STAGE.KEY");
  what->add_option("--effective", arguments->effective, "A file with every value written out");
  what->require_option(1);
  command->add_option("--set", arguments->overrides.assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command->add_option("--profile", arguments->profile, "paper or compact")
      ->check(CLI::IsMember({"paper", "compact"}));
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    if (!arguments->profile.empty()) arguments->overrides.profile = arguments->profile;
    if (arguments->defaults) {
      std::cout << defaultsYaml(table,
                                arguments->profile == "paper" ? Profile::Paper : Profile::Compact);
    } else if (!arguments->explain.empty()) {
      std::cout << explain(table, arguments->explain);
    } else {
      std::cout << effective(arguments->effective, table, arguments->overrides);
    }
  });
}

}  // namespace planar_mapping::tools
