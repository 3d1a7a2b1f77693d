// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

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
  void process(Frame& frame) override {
    const std::optional<StereoNoise> noise = noise_.optionalNoise();
    if (!noise) return;
    const FrameCloud& cloud = *frame.cloud;
    const auto is_poor = [&](int i) {
      return noise->depthError(cloud[static_cast<std::size_t>(i)].z) > max_error_;
    };
    frame.indices.erase(std::remove_if(frame.indices.begin(), frame.indices.end(), is_poor),
                        frame.indices.end());
  }

 private:
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
