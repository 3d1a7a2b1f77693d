// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "../marked_indices.h"
#include "builtin.h"
#include "noise_keys.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping {
namespace {

/// Not a number is no depth to be judged.
PLANAR_MAPPING_MULTIVERSION
void markWithin(const float* depths, std::size_t n, float farthest, std::uint8_t* marks) {
  for (std::size_t i = 0; i < n; ++i) marks[i] = __builtin_fabsf(depths[i]) > farthest ? 0 : 1;
}

void keepWithin(float farthest, const FrameCloud& cloud, Indices& indices) {
  constexpr std::size_t kBlock = 1024;
  // What the processor fetches by itself ends with each page.
  constexpr std::size_t kAhead = 256;
  float depths[kBlock];
  std::uint8_t marks[kBlock];
  int* kept = indices.data();
  for (std::size_t first = 0; first < indices.size(); first += kBlock) {
    const std::size_t n = std::min(kBlock, indices.size() - first);
    const int* block = indices.data() + first;
    for (std::size_t i = 0; i < n; ++i) {
      const float* point = cloud.points[static_cast<std::size_t>(block[i])].data;
      __builtin_prefetch(point + 4 * kAhead);
      depths[i] = point[2];
    }
    markWithin(depths, n, farthest, marks);
    kept = detail::copyMarked(block, marks, n, 1, kept);
  }
  indices.resize(static_cast<std::size_t>(kept - indices.data()));
}

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
    keepWithin(farthestDepth(*noise), *frame.cloud, frame.indices);
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
