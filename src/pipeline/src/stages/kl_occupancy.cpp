// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/kl_occupancy_filter.h"

#include "builtin.h"
#include "keys/stage_keys.h"

namespace planar_mapping {
namespace {

class KlOccupancyStage : public Stage {
 public:
  static constexpr const char* kName = "kl_occupancy";
  static constexpr const char* kSummary =
      "probability of points from features seen over frames (the paper, III-D, III-E, Eq. 4-10)";
  static constexpr StageKind kKind = StageKind::Beliefs;

  void applyProfile(Profile profile) override { keys_.applyProfile(profile); }
  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings& settings) override { keys_.configure(settings); }
  void adapt(const CloudScale& scale) override {
    keys_.adapt(scale);
    filter_.setParams(keys_.params);
  }

  void process(Frame& frame) override {
    std::vector<std::int32_t> labels(frame.cloud->size(), -1);
    for (std::size_t plane = 0; plane < frame.planes.size(); ++plane) {
      for (const int i : frame.planes[plane].inliers) {
        labels[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(plane);
      }
    }
    filter_.setInputCloud(frame.cloud);
    filter_.setIndices(detail::sharedIndices(frame.indices));
    filter_.setSensorPose(frame.T_world_sensor);
    filter_.setInputPlaneLabels(std::move(labels));
    filter_.setInputKeyFeatures(frame.key_features);
    filter_.setMotion(frame.motion);
    Indices believed;  // the map weighs the others by their probability
    filter_.filter(believed);
    frame.probability = filter_.takeProbabilities();
    filter_.setInputPlaneLabels({});
    filter_.setInputCloud(nullptr);
    const FeatureBeliefs::Summary& seen = filter_.getDiagnostics().beliefs;
    frame.features = seen.created + seen.updated;
    frame.matches = seen.updated;
  }

  std::string saveState() const override { return filter_.saveState(); }
  void loadState(const std::string& bytes) override { filter_.loadState(bytes); }

 private:
  detail::BeliefKeys keys_;
  KLOccupancyFilter<pcl::PointXYZ> filter_;
};
}  // namespace

void detail::addKlOccupancy(StageTable& table) {
  table.add<KlOccupancyStage>();
}

}  // namespace planar_mapping
