// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>

#include "commands.h"
#include "parameter_text.h"
#include "planar_mapping/pipeline/plugin.h"

namespace planar_mapping::tools {
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
