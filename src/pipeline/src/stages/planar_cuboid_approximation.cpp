// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "builtin.h"
#include "keys/stage_keys.h"
#include "planar_mapping/surface/planar_mapping.h"
#include "rounded.h"

namespace planar_mapping {
namespace {

class PlanarCuboidApproximationStage : public Stage {
 public:
  static constexpr const char* kName = "planar_cuboid_approximation";
  static constexpr const char* kSummary =
      "turns planes and other points into oriented cuboids of the map (the paper, III-F and IV)";
  static constexpr StageKind kKind = StageKind::Map;

  void applyProfile(Profile profile) override { keys_.applyProfile(profile); }
  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings& settings) override { keys_.configure(settings.threads); }
  void adapt(const CloudScale& scale) override { keys_.adapt(scale); }
  std::optional<double> resolution() const override { return keys_.resolution; }
  void configureMap(PlanarMapParams& params) const override { params = keys_.params; }
  void process(Frame& frame) override {
    mapping_.setMap(*frame.map);
    mapping_.setInputCloud(frame.cloud);
    mapping_.setIndices(detail::sharedIndices(frame.indices));
    mapping_.setSensorPose(frame.T_world_sensor);
    mapping_.setTimestamp(frame.timestamp);
    mapping_.setGroundIndices(frame.ground);
    mapping_.setPlanes(std::move(frame.planes));
    mapping_.setPointProbabilities(std::move(frame.probability));
    mapping_.setAssumedPoints(frame.assumed);
    mapping_.setCamera(frame.camera);
    mapping_.setNoiseModel(keys_.noise.optionalNoise());
    frame.update = mapping_.integrate();
    frame.planes = mapping_.takePlanes();
    frame.probability = mapping_.takePointProbabilities();
    mapping_.setInputCloud(nullptr);
    frame.inserted = true;
    if (std::isfinite(frame.update.space_range)) {
      frame.notes.push_back(frame.source + ": space is classified up to " +
                            detail::rounded(frame.update.space_range, 0) +
                            " m only, all of it would be too much for one frame; a coarser "
                            "unknown_resolution_m reaches farther");
    }
  }

 private:
  detail::MapKeys keys_;
  PlanarMapping<pcl::PointXYZ> mapping_;
};

}  // namespace

void detail::addPlanarCuboidApproximation(StageTable& table) {
  table.add<PlanarCuboidApproximationStage>();
}

}  // namespace planar_mapping
