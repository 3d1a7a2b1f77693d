// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "features/feature_detection.h"
#include "planar_mapping/core/registration/detail/view_agreement.h"
#include "planar_mapping/stereo/detail/view_map.h"

namespace planar_mapping {

/// An image with depth: its cells, and its features once they are needed.
class ViewMap::View {
 public:
  View() = default;
  View(const io::Image& image, const PointsView& cloud, const PinholeCamera& pinhole);

  /// Finds the features; image and depth are not needed any more then.
  void detect(const ViewMapParams& params);
  template <typename Archive>
  void visitState(Archive& archive) {
    archive(cells.camera, cells.points, cells.nearest, cells.farthest, cells.tones, cells.facing,
            sightings, descriptors, gray_.width, gray_.height, gray_.channels, gray_.pixels,
            camera_, depths_, detected_);
  }

  ViewCells cells;
  std::vector<FeatureSighting> sightings;
  detail::Descriptors descriptors;

 private:
  io::Image gray_;
  PinholeCamera camera_;
  std::vector<float> depths_;  ///< 0 = none
  bool detected_ = false;
};

}  // namespace planar_mapping
