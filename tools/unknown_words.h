// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "planar_mapping/base/spelling.h"

namespace planar_mapping::tools {

/// "; did you mean '--output'?" for the first word that the program does not know, or "".
inline std::string suggestionFor(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  const std::vector<std::string> words = app.remaining(true);
  if (words.empty()) return "";
  const std::string word = words.front().substr(0, words.front().find('='));
  const bool is_option = word.front() == '-';
  std::vector<std::string> known;
  if (is_option) {
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  } else {
    for (const CLI::App* one : command->get_subcommands({})) known.push_back(one->get_name());
  }
  return detail::didYouMean(word, known);
}

}  // namespace planar_mapping::tools
