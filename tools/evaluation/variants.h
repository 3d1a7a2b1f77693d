// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/evaluation/evaluation_report.h"

namespace planar_mapping::tools {

/// A planar map under a name: a profile and assignments on top of the configuration.
struct Variant {
  std::string name;
  std::string profile;
  std::vector<std::string> assignments;  ///< stage.key=value
};

/// The compact profile without one idea each: what is its fraction?
std::vector<Variant> ablationVariants();

/// Exact and tolerant covers, with planes and without, with the filters of the planar map and
/// without (METHOD: IV-B). `boxes` is without planes, `raw` without filters.
std::vector<Variant> regimeVariants();
/// The one of them whose boxes cover exactly the cells that pass the filters.
constexpr const char* kFilteredCells = "boxes_exact";

/// "NAME:stage.key=value,stage.key=value", on the compact profile.
/// \throws UsageError
Variant parseVariant(const std::string& text);

/// The results of all other methods.
std::vector<evaluation::PlaceResult> withoutMethods(
    const std::vector<evaluation::PlaceResult>& results, const std::vector<std::string>& methods);

}  // namespace planar_mapping::tools
