// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "builtin.h"
#include "keys/stage_keys.h"

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
    const PointsView points = pointsOf(*frame.cloud);
    const float farthest = farthestDepth(*noise);
    const auto is_beyond = [&](int i) {
      return std::abs(points[static_cast<std::size_t>(i)][2]) > farthest;
    };
    frame.indices.erase(std::remove_if(frame.indices.begin(), frame.indices.end(), is_beyond),
                        frame.indices.end());
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

void detail::addDepthErrorLimit(StageTable& table) {
  table.add<DepthErrorLimitStage>();
}

}  // namespace planar_mapping
