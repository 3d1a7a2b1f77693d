// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "commands.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping::tools {
namespace {

using Json = nlohmann::ordered_json;

/// A finished map knows of no frames and planes.
Json factsOf(const PlanarMap& map) {
  return {{"frames", map.isFinished() ? Json() : Json(map.frames())},
          {"resolution_m", map.params().approximation.resolution},
          {"planes", map.isFinished() ? Json() : Json(map.planes().size())},
          {"cuboids", map.cuboids().size()},
          {"unknown_cells", map.unknownCells()}};
}

void print(const Json& a, const Json& b, const MapDifference& difference) {
  for (const auto& item : a.items()) {
    std::cout << item.key() << ": " << item.value() << ' ' << b[item.key()] << '\n';
  }
  std::cout << "occupied cells of " << difference.cell << " m: " << difference.in_both
            << " in both, " << difference.only_in_a << " only in the first, "
            << difference.only_in_b << " only in the second\ndifference: " << difference.fraction()
            << '\n';
}

}  // namespace

void addCompareCommand(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string first, second;
    double threshold = 0.0;
    bool json = false;
  };
  auto* command = app.add_subcommand("compare", "What differs between two maps");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("first", arguments->first, "Map (*.pmap)")->required();
  command->add_option("second", arguments->second, "Map (*.pmap)")->required();
  command
      ->add_option("--threshold", arguments->threshold,
                   "Exit code 6 if a larger fraction of the occupied cells is in one map only")
      ->check(numberIn(0.0, 1.0))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "For machines");
  command->callback([arguments, &exit_code]() {
    const PlanarMap first = io::loadMap(arguments->first);
    const PlanarMap second = io::loadMap(arguments->second);
    if (first.params().origin != second.params().origin) {
      throw InputError(arguments->second + ": this map has another origin than " +
                       arguments->first + " (planar_map info shows both)");
    }
    warnOfFrames({{arguments->first, &first}, {arguments->second, &second}}, "");
    const MapDifference difference = compareMaps(first, second);
    const Json a = factsOf(first), b = factsOf(second);
    if (arguments->json) {
      const Json answer = {{"first", a},
                           {"second", b},
                           {"cell_m", difference.cell},
                           {"in_both", difference.in_both},
                           {"only_in_first", difference.only_in_a},
                           {"only_in_second", difference.only_in_b},
                           {"difference", difference.fraction()}};
      std::cout << answer.dump(2) << '\n';
    } else {
      print(a, b, difference);
    }
    if (difference.fraction() > arguments->threshold) exit_code = kOverThreshold;
  });
}

}  // namespace planar_mapping::tools
