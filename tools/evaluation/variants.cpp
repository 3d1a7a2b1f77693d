// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "variants.h"

#include <algorithm>
#include <sstream>

#include "../commands.h"

namespace planar_mapping::tools {

std::vector<Variant> ablationVariants() {
  // One line an idea; the keys are those of `planar_map stages --describe NAME`.
  static const std::vector<Variant> kVariants = {
      {"exact cover", "compact", {"planar_cuboid_approximation.absorption_cells=0"}},
      {"no choice per region", "compact", {"planar_cuboid_approximation.rectangle_cells=0"}},
      {"no hole filling", "compact", {"planar_cuboid_approximation.hole_size_m=0.000001"}},
      {"no noise model", "compact", {"planar_cuboid_approximation.noise=none"}},
      {"no doubt in first sights", "compact", {"planar_cuboid_approximation.first_belief=1"}},
      {"no misses", "compact", {"planar_cuboid_approximation.miss_factor=1"}},
      {"no fraction of a full cell",
       "compact",
       {"planar_cuboid_approximation.min_cell_fraction=0"}},
      {"surfaces without noise", "compact", {"planar_cuboid_approximation.surface_factor=0"}},
      {"strips without noise", "compact", {"planar_cuboid_approximation.rim_pixels=1000"}},
      {"no beliefs of features", "compact", {"kl_occupancy.enabled=false"}},
      {"no update of beliefs", "compact", {"kl_occupancy.update=none"}},
      {"no planes", "compact", {"multi_plane_segmentation.enabled=false"}},
  };
  return kVariants;
}

std::vector<Variant> regimeVariants() {
  const std::string stage = "planar_cuboid_approximation.";
  std::vector<Variant> variants;
  for (const bool raw : {false, true}) {
    for (const bool exact : {true, false}) {
      for (const bool boxes : {true, false}) {
        Variant variant{boxes ? "boxes" : "planes", "compact", {}};
        if (boxes) variant.assignments.emplace_back("multi_plane_segmentation.enabled=false");
        if (exact) {
          variant.name += "_exact";
          for (const char* one : {"absorption_cells=0", "hole_size_m=0.000001"})
            variant.assignments.push_back(stage + one);
        }
        if (raw) {
          variant.name += "_raw";
          variant.assignments.emplace_back("kl_occupancy.enabled=false");
          for (const char* one : {"first_belief=1", "min_cell_fraction=0", "noise=none"})
            variant.assignments.push_back(stage + one);
        }
        if (!variant.assignments.empty()) variants.push_back(std::move(variant));
      }
    }
  }
  return variants;
}

Variant parseVariant(const std::string& text) {
  const std::size_t colon = text.find(':');
  Variant variant{text.substr(0, colon), "compact", {}};
  if (colon == std::string::npos || variant.name.empty()) {
    throw UsageError("--variant: '" + text + "' is not NAME:stage.key=value,...");
  }
  std::istringstream assignments(text.substr(colon + 1));
  for (std::string one; std::getline(assignments, one, ',');) variant.assignments.push_back(one);
  if (variant.assignments.empty()) {
    throw UsageError("--variant: '" + text + "' changes nothing; give NAME:stage.key=value,...");
  }
  return variant;
}

std::vector<evaluation::PlaceResult> withoutMethods(
    const std::vector<evaluation::PlaceResult>& results, const std::vector<std::string>& methods) {
  std::vector<evaluation::PlaceResult> kept;
  for (const evaluation::PlaceResult& result : results) {
    if (std::find(methods.begin(), methods.end(), result.method) == methods.end()) {
      kept.push_back(result);
    }
  }
  return kept;
}

}  // namespace planar_mapping::tools
