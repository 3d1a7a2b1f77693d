// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

#include "builtin.h"
#include "keys/stage_keys.h"

namespace planar_mapping {
namespace {

class MultiPlaneSegmentationStage : public Stage {
 public:
  static constexpr const char* kName = "multi_plane_segmentation";
  static constexpr const char* kSummary = "finds the planes of the frame (the paper, III-C)";
  static constexpr StageKind kKind = StageKind::Planes;

  void applyProfile(Profile profile) override { keys_.applyProfile(profile); }
  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings& settings) override { keys_.configure(settings); }
  void adapt(const CloudScale& scale) override { keys_.adapt(scale); }
  void process(Frame& frame) override {
    segmentation_.setParams(keys_.params);
    segmentation_.setInputCloud(frame.cloud);
    segmentation_.setIndices(detail::sharedIndices(frame.indices));
    segmentation_.setInputFeatures(frame.key_features);
    segmentation_.segment();
    segmentation_.setInputCloud(nullptr);
    frame.planes = segmentation_.takePlanes();
    if (keys_.assumed_probability > 0.0 && !frame.even.empty() && frame.camera) {
      frame.assumed = assumePoints(
          pointsOf(*frame.cloud), frame.indices, frame.ground, *frame.camera, frame.even,
          frame.T_world_sensor.linear().transpose() * keys_.up, keys_.params, frame.planes);
      frame.assumed.probability = keys_.assumed_probability;
      frame.statistics.push_back(
          {"assumed_points", static_cast<double>(frame.assumed.xyz.size() / 3)});
    }
    if (keys_.params.source == PlaneSource::Dense) return;
    const auto number = static_cast<double>(frame.planes.size());
    const auto dense =
        static_cast<double>(segmentation_.getDiagnostics().features.planes_of_dense_points);
    frame.statistics.push_back({"planes_from_features", number - dense});
    frame.statistics.push_back({"planes_from_dense", dense});
  }

 private:
  detail::PlaneKeys keys_;
  MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation_;
};

}  // namespace

void detail::addMultiPlaneSegmentation(StageTable& table) {
  table.add<MultiPlaneSegmentationStage>();
}

}  // namespace planar_mapping
