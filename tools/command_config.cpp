// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>

#include "commands.h"
#include "parameter_text.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/configuration.h"
#include "planar_mapping/pipeline/plugin.h"

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

void addValidateCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string configuration;
    ConfigurationOverrides overrides;
    bool quiet = false;
  };
  auto* command =
      app.add_subcommand("validate", "Every problem of a configuration in one go; nothing is run");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("config", arguments->configuration, "Configuration file (*.yaml)")
      ->required();
  command->add_option("--set", arguments->overrides.assignments, "stage.key=value, repeatable")
      ->allow_extra_args(false);
  command->add_flag("-q,--quiet", arguments->quiet, "Say nothing but problems");
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    const Configuration configuration =
        loadConfiguration(arguments->configuration, table, arguments->overrides, Plugins::Ignore);
    for (const std::string& name : configuration.unknown_stages) {
      std::cerr << arguments->configuration << ": stage '" << name
                << "' is not checked: plugins are loaded by run alone\n";
    }
    if (!arguments->quiet) std::cout << arguments->configuration << ": no problems\n";
  });
}

namespace {

void printList(const StageTable& table) {
  std::size_t width = 0;
  for (const StageEntry& entry : table.entries()) width = std::max(width, entry.name.size());
  for (const StageEntry& entry : table.entries()) {
    std::cout << entry.name << std::string(width + 2 - entry.name.size(), ' ') << entry.summary
              << '\n';
  }
}

}  // namespace

void addStagesCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string describe;
    std::vector<std::string> plugins;
    bool markdown = false;
  };
  auto* command = app.add_subcommand("stages", "The stages there are and their parameters");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("--describe", arguments->describe, "One stage with all its parameters");
  command->add_option("--plugin", arguments->plugins, "Shared library with more stages");
  command->add_flag("--markdown", arguments->markdown, "All of them as docs/parameters.md");
  command->callback([arguments]() {
    StageTable table;
    registerBuiltinStages(table);
    for (const std::string& plugin : arguments->plugins) loadPlugin(plugin, table);
    if (arguments->markdown) {
      std::cout << referencePage(table);
    } else if (arguments->describe.empty()) {
      printList(table);
    } else if (const StageEntry* entry = table.find(arguments->describe)) {
      std::cout << describeStage(*entry);
    } else {
      throw UsageError("there is no stage '" + arguments->describe +
                       "'; planar_map stages lists them");
    }
  });
}

}  // namespace planar_mapping::tools
