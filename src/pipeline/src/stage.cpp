// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/stage.h"

namespace planar_mapping {

Stage::~Stage() = default;
void Stage::applyProfile(Profile) {}
void Stage::configure(const RunSettings&) {}
void Stage::adapt(const CloudScale&) {}
void Stage::limit(CloudScale&) const {}
void Stage::configureMap(PlanarMapParams&) const {}

}  // namespace planar_mapping
