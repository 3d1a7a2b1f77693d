// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "builtin.h"
#include "noise_keys.h"

namespace planar_mapping {
namespace {

/// A far point of a stereo camera says less about its place than a cell is large.
class DepthErrorLimitStage : public Stage {
 public:
  static constexpr const char* kName = "depth_error_limit";
  static constexpr const char* kSummary =
      "drops points whose depth error dz(z) is too large for the map [ours]";
  static constexpr StageKind kKind = StageKind::Points;

  void applyProfile(Profile profile) override {
    if (profile == Profile::Paper) noise_.setSource(detail::NoiseKeys::Source::None);
  }
  void declare(ParameterTable& table) override {
    table.number("max_error_m", max_error_, Range::positive(), "largest dz(z) that is kept");
    noise_.declareOptional(table, "without it, nothing is dropped");
  }
  void adapt(const CloudScale& scale) override { noise_.adapt(scale); }
  void limit(CloudScale& scale) const override {
    const std::optional<StereoNoise> noise = noise_.optionalNoise();
    if (!noise) return;
    const double farthest = farthestDepth(*noise);
    if (!std::isfinite(farthest)) return;
    scale.depth_limit = std::min(farthest, scale.depth_limit.value_or(farthest));
  }
  void process(Frame& frame) override {
    const std::optional<StereoNoise> noise = noise_.optionalNoise();
    if (!noise) return;
    const float farthest = farthestDepth(*noise);
    const pcl::PointXYZ* points = frame.cloud->points.data();
    const int* const end = frame.indices.data() + frame.indices.size();
    int* kept = frame.indices.data();
    // Written always and counted where it stays: which points do, no branch could foresee.
    for (const int* index = kept; index != end; ++index) {
      // What the processor fetches by itself ends with each page.
      constexpr std::ptrdiff_t kAhead = 256;
      __builtin_prefetch(points + index[end - index > kAhead ? kAhead : 0]);
      *kept = *index;
      kept += std::fabs(points[static_cast<std::size_t>(*index)].z) > farthest ? 0 : 1;
    }
    frame.indices.resize(static_cast<std::size_t>(kept - frame.indices.data()));
  }

 private:
  /// The largest depth whose error is within max_error_, so that points need no division. The
  /// error never falls with the depth, whatever is rounded, and neither do the bits of a float.
  float farthestDepth(const StereoNoise& noise) const {
    std::uint32_t within = 0;
    std::uint32_t beyond = 0x7F800000U;  // infinity
    const auto depthOf = [](std::uint32_t bits) {
      float depth = 0.0F;
      std::memcpy(&depth, &bits, sizeof(depth));
      return depth;
    };
    if (!(noise.depthError(depthOf(beyond)) > max_error_)) return depthOf(beyond);
    while (beyond - within > 1) {
      const std::uint32_t middle = within + (beyond - within) / 2;
      (noise.depthError(depthOf(middle)) > max_error_ ? beyond : within) = middle;
    }
    return depthOf(within);
  }

  double max_error_ = 0.1;
  detail::NoiseKeys noise_;
};

}  // namespace

namespace detail {

void addDepthErrorLimit(StageTable& table) {
  table.add<DepthErrorLimitStage>();
}

}  // namespace detail
}  // namespace planar_mapping
