// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/stage.h"

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {

Stage::~Stage() = default;
void Stage::applyProfile(Profile) {}
void Stage::configure(const RunSettings&) {}
void Stage::adapt(const CloudScale&) {}
void Stage::limit(CloudScale&) const {}
void Stage::configureMap(PlanarMapParams&) const {}
std::string Stage::saveState() const {
  return {};
}
void Stage::loadState(const std::string& bytes) {
  if (!bytes.empty()) throw Error("a stage has a saved state that it does not know");
}

}  // namespace planar_mapping
