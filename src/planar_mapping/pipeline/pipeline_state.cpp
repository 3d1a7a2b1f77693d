// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/base/state_archive.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

template <typename Archive>
void visitScale(CloudScale& scale, Archive& archive) {
  archive(scale.extent, scale.spacing, scale.max_range, scale.depth_limit, scale.points,
          scale.stereo, scale.optical, scale.up, scale.noise, scale.has_sensor);
}

void putScale(std::optional<CloudScale> scale, detail::StateWriter& writer) {
  writer(scale.has_value());
  if (scale) visitScale(*scale, writer);
}

std::optional<CloudScale> takeScale(detail::StateReader& reader) {
  bool has_value = false;
  reader(has_value);
  if (!has_value) return std::nullopt;
  CloudScale scale;
  visitScale(scale, reader);
  return scale;
}

}  // namespace

/// What stages look at of a frame that waits for its place.
template <typename Archive>
void Pipeline::LeftOut::visitState(Archive& archive) {
  Frame& f = frame;
  io::Image& image = f.images.left;
  std::vector<float> xyz;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  if constexpr (!Archive::kReads) {
    width = f.cloud->width;
    height = f.cloud->height;
    for (const pcl::PointXYZ& point : f.cloud->points)
      xyz.insert(xyz.end(), {point.x, point.y, point.z});
  }
  archive(attempts, f.number, f.source, f.timestamp, f.T_world_sensor, f.camera, f.baseline,
          f.given_pose, f.pose_assumed, f.front_end_done, f.image_doubtful, f.skip_reason,
          f.without_sensor, f.indices, f.even, f.points_input, f.points_valid, f.stage_ms,
          image.width, image.height, image.channels, image.pixels, width, height, xyz);
  if constexpr (Archive::kReads) f.cloud = cloudOf(xyz, width, height);
  std::size_t features = f.key_features.size();
  std::size_t statistics = f.statistics.size();
  archive(features, statistics);
  const auto visitAll = [](std::size_t count, auto& list, const auto& visit) {
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (Archive::kReads) list.emplace_back();
      visit(list[i]);
    }
  };
  visitAll(features, f.key_features, [&](KeyFeature& k) {
    archive(k.track, k.sightings, k.column, k.row, k.disparity, k.position);
  });
  visitAll(statistics, f.statistics,
           [&](FrameStatistic& statistic) { archive(statistic.name, statistic.value); });
}

std::string Pipeline::saveState() const {
  detail::StateWriter writer;
  writer(last_pictures_, origin_, counted_frames_, cuboids_, left_out_);
  for (const std::optional<CloudScale>& scale : sensing_scales_) putScale(scale, writer);
  putScale(mapping_scale_, writer);
  for (const ConfiguredStage& stage : configuration_.stages)
    writer(stage.name, stage.stage->saveState());
  return writer.take();
}

void Pipeline::loadState(const std::string& state, PlanarMap map) {
  detail::StateReader reader(state);
  reader(last_pictures_, origin_, counted_frames_, cuboids_, left_out_);
  for (std::size_t i = 0; i < sensing_size_; ++i) {
    sensing_scales_[i] = takeScale(reader);
    if (!sensing_scales_[i]) continue;
    sensing_scales_[i]->resolution = givenResolution();
    configuration_.stages[i].stage->adapt(*sensing_scales_[i]);
  }
  const std::optional<CloudScale> mapping_scale = takeScale(reader);
  if (mapping_scale) {
    adaptMapping(*mapping_scale, nullptr);
    map_ = std::move(map);
  }
  for (const ConfiguredStage& stage : configuration_.stages) {
    std::string name;
    std::string bytes;
    reader(name, bytes);
    if (name != stage.name) throw Error("the saved state is of other stages");
    stage.stage->loadState(bytes);
  }
  reader.finish();
}

}  // namespace planar_mapping
