// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>

#include "commands.h"
#include "planar_mapping/pipeline/configuration.h"

namespace planar_mapping::tools {

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

}  // namespace planar_mapping::tools
