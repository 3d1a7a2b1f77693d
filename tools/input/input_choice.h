// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/io/sequence.h"

namespace planar_mapping::tools {

/// A ready configuration for an input.
struct InputChoice {
  std::string configuration;             ///< path
  std::vector<std::string> assignments;  ///< "stage.key=value"
  std::string sentence;                  ///< what the input is and what was chosen
};

/// \param input  as a person calls it, for the sentence
InputChoice chooseConfiguration(const std::string& input, const io::Sequence& sequence);

/// Whether a word of the command line is a configuration, not an input.
bool isConfigurationName(const std::string& word);

}  // namespace planar_mapping::tools
