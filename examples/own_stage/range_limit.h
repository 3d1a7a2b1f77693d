// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "planar_mapping/pipeline/stage.h"

/// A stage of your own: drops points farther from the sensor than a limit.
class RangeLimit : public planar_mapping::Stage {
 public:
  static constexpr const char* kName = "range_limit";
  static constexpr const char* kSummary = "drops points far from the sensor";
  static constexpr planar_mapping::StageKind kKind = planar_mapping::StageKind::Points;

  void declare(planar_mapping::ParameterTable& table) override {
    table.number("max_range_m", max_range_, planar_mapping::Range::positive(), "largest range");
  }

  void process(planar_mapping::Frame& frame) override {
    const auto too_far = [&](int i) {
      return frame.cloud->at(static_cast<std::size_t>(i)).getVector3fMap().norm() > max_range_;
    };
    auto& indices = frame.indices;
    indices.erase(std::remove_if(indices.begin(), indices.end(), too_far), indices.end());
  }

 private:
  double max_range_ = 5.0;  // metres
};
